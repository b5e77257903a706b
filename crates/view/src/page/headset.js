// WebXR: sends both hands to the server, shows the room to the wearer.

/** y up and -z forward to z up and x forward. */
const Z_UP = [0, -1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 0, 0, 0, 0, 1];
const vector3 = ({ x, y, z }) => [x, y, z];

class Headset {
  constructor(shown, scene, { send, begins, ends, newest, recentred, pinched, words }) {
    Object.assign(this, { shown, scene, send, begins, ends, newest, recentred, pinched, words, session: null, onFloor: null, marks: [], target: null, seen: {}, tips: {} });
    this.plate = new Plate(shown.viewer.gl);
    this.place(scene.base_from_headset);
  }

  /** The space stands here in the frame of the base. */
  place(pose) { this.baseFromSpace = multiply(pose ? poseMatrix(pose) : IDENTITY, Z_UP); }

  static async offered(kind = "immersive-vr") {
    try { return (await navigator.xr?.isSessionSupported(kind)) === true; } catch { return false; }
  }

  async enter(kind = "immersive-vr") {
    const { gl } = this.shown.viewer;
    const session = await navigator.xr.requestSession(kind, { optionalFeatures: ["local-floor", "hand-tracking"] });
    await gl.makeXRCompatible();
    // The real room shows through where there is one to be seen.
    this.isThrough = (session.environmentBlendMode ?? "opaque") !== "opaque";
    this.layer = new XRWebGLLayer(session, gl, { stencil: true });
    session.updateRenderState({ baseLayer: this.layer, depthNear: 0.03, depthFar: 80 });
    // At the floor if the headset knows it; the server's settings give its pose.
    let onFloor = true;
    this.space = await session.requestReferenceSpace("local-floor").catch(() => { onFloor = false; return session.requestReferenceSpace("local"); });
    this.session = session;
    this.onFloor = onFloor;
    this.space.addEventListener("reset", () => this.recentred());
    // Headsets fire it for a pinch.
    session.addEventListener("select", ({ inputSource }) => this.pinched(inputSource.handedness));
    session.addEventListener("end", () => { this.session = null; this.onFloor = null; this.hands = []; this.ends(); });
    this.begins(onFloor);
    const step = (ms, frame) => {
      if (!this.session) return;
      this.session.requestAnimationFrame(step);
      this.sample(ms, frame);
      this.draw(frame);
    };
    session.requestAnimationFrame(step);
  }

  leave() { this.session?.end(); }

  /** Joints of both hands and the head, as the headset has them: the server knows where its space stands. */
  sample(ms, frame) {
    const viewer = frame.getViewerPose(this.space);
    const head = viewer && [...vector3(viewer.transform.position), viewer.transform.orientation.x, viewer.transform.orientation.y, viewer.transform.orientation.z, viewer.transform.orientation.w];
    // Without an eye tracker, gaze is the direction of the head: its -z axis.
    const gaze = viewer && unit(scale([...viewer.transform.matrix].slice(8, 11), -1));
    this.hands = [];
    // A hand that is out of view is sent as such, with the head: some headsets then have no source for it.
    for (const side of ["left", "right"]) {
      const source = [...this.session.inputSources].find((one) => one.hand && one.handedness === side);
      const joints = source ? [...source.hand.values()].map((joint) => {
        const pose = joint && frame.getJointPose(joint, this.space);
        return pose ? vector3(pose.transform.position) : null;
      }) : [];
      const seen = joints.some(Boolean);
      this.tips[side] = joints[joints.length - 16] ?? null;
      if (seen) this.seen[side] = performance.now();
      this.send({
        type: "hand", seq: 0, client_ms: ms, side,
        joints: seen ? joints.map((joint) => joint && rounded(joint)) : null, head: head && rounded(head), gaze: gaze && rounded(gaze),
        axes: "webxr", source: "webxr",
      });
      // Show the wearer's hands as they are now, not as the server returns them.
      if (seen) this.hands.push([...(joints.length === 25 ? [null] : []), ...joints].map((joint) => joint && point(this.baseFromSpace, joint)));
    }
  }

  /** Marks where the tip of an index finger is now. */
  mark(side) { if (this.tips[side]) this.marks.push(this.tips[side]); }

  draw(frame) {
    const pose = frame.getViewerPose(this.space), seen = this.newest();
    const { viewer } = this.shown, { gl } = viewer;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.layer.framebuffer);
    // Never black: the sky is there before the first picture of the arm.
    gl.clearColor(...(this.isThrough ? [0, 0, 0, 0] : [...viewer.theme.sky, 1]));
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    if (!pose || !(seen || this.isThrough)) return;
    const balls = this.marks.map((mark) => [point(this.baseFromSpace, mark), 0.01, MARK]);
    if (this.target) balls.push([point(this.baseFromSpace, this.target), 0.012, NEXT]);
    if (this.isThrough) viewer.bare(this.hands, balls);
    // The wearer sees the room and their hands, but no predictions.
    else viewer.compose({ ...seen, eye: point(this.baseFromSpace, vector3(pose.transform.position)), head: null, gaze: null, predicted: null, goal: null, force: null }, this.hands, balls);
    this.plate.say(this.words());
    const spaceFromBase = inverseRigid(this.baseFromSpace);
    for (const view of pose.views) {
      const { x, y, width, height } = this.layer.getViewport(view);
      gl.viewport(x, y, width, height);
      const eye = point(this.baseFromSpace, vector3(view.transform.position));
      const eyes = { projection: [...view.projectionMatrix], view: multiply([...view.transform.inverse.matrix], spaceFromBase), eye };
      if (this.isThrough) viewer.drawBare(eyes); else viewer.draw(eyes, { solidWalls: true, showArm: true });
      this.plate.draw(multiply(eyes.projection, [...view.transform.inverse.matrix]), [...pose.transform.matrix]);
    }
  }
}
