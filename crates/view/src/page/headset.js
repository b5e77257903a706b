// WebXR: sends both hands to the server, shows the room to the wearer.

/** y up and -z forward to z up and x forward. */
const Z_UP = [0, -1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 0, 0, 0, 0, 1];
const vector3 = ({ x, y, z }) => [x, y, z];

class Headset {
  constructor(shown, scene, { send, begins, ends, newest }) {
    Object.assign(this, { shown, scene, send, begins, ends, newest, session: null });
    this.baseFromSpace = multiply(scene.base_from_headset ? poseMatrix(scene.base_from_headset) : IDENTITY, Z_UP);
  }

  static async offered() {
    try { return (await navigator.xr?.isSessionSupported("immersive-vr")) === true; } catch { return false; }
  }

  async enter() {
    const { gl } = this.shown.viewer;
    const session = await navigator.xr.requestSession("immersive-vr", { optionalFeatures: ["local-floor", "hand-tracking"] });
    await gl.makeXRCompatible();
    this.layer = new XRWebGLLayer(session, gl, { stencil: true });
    session.updateRenderState({ baseLayer: this.layer, depthNear: 0.03, depthFar: 80 });
    // At the floor if the headset knows it; the server's settings give its pose.
    let onFloor = true;
    this.space = await session.requestReferenceSpace("local-floor").catch(() => { onFloor = false; return session.requestReferenceSpace("local"); });
    this.session = session;
    session.addEventListener("end", () => { this.session = null; this.ends(); });
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
    for (const source of this.session.inputSources) {
      if (!source.hand) continue;
      const joints = [...source.hand.values()].map((joint) => {
        const pose = joint && frame.getJointPose(joint, this.space);
        return pose ? vector3(pose.transform.position) : null;
      });
      const seen = joints.some(Boolean);
      this.send({
        type: "hand", seq: 0, client_ms: ms, side: source.handedness === "left" ? "left" : "right",
        joints: seen ? joints.map((joint) => joint && rounded(joint)) : null, head: head && rounded(head), gaze: gaze && rounded(gaze),
        axes: "webxr", source: "webxr",
      });
      // Show the wearer's hands as they are now, not as the server returns them.
      if (seen) this.hands.push([...(joints.length === 25 ? [null] : []), ...joints].map((joint) => joint && point(this.baseFromSpace, joint)));
    }
  }

  draw(frame) {
    const pose = frame.getViewerPose(this.space), seen = this.newest();
    if (!pose || !seen) return;
    const { viewer } = this.shown, { gl } = viewer;
    // The wearer sees the room and their hands, but no predictions.
    viewer.compose({ ...seen, head: null, gaze: null, predicted: null, goal: null, force: null }, this.hands);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.layer.framebuffer);
    gl.clearColor(...viewer.theme.sky, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    const spaceFromBase = inverseRigid(this.baseFromSpace);
    for (const view of pose.views) {
      const { x, y, width, height } = this.layer.getViewport(view);
      gl.viewport(x, y, width, height);
      const eye = point(this.baseFromSpace, vector3(view.transform.position));
      viewer.draw(
        { projection: [...view.projectionMatrix], view: multiply([...view.transform.inverse.matrix], spaceFromBase), eye },
        { solidWalls: true, showArm: true },
      );
    }
  }
}
