// Shared by both pages: the picture, the panel, the views.
const $ = (id) => document.getElementById(id);
const seconds = (t) => (t == null ? "–" : `${t.toFixed(2)} s`);

/** Makes the picture and the panel; returns the means to show frames in them. */
function stage(scene, takes, claiming) {
  const canvas = $("view");
  const stale = { is: true };
  const camera = new Camera(() => { stale.is = true; });
  const viewer = new Viewer(canvas, scene);
  const labels = new Labels($("labels"));
  document.title = scene.title;
  $("title").textContent = scene.title;
  let eyes = false;
  const theme = (name) => {
    document.documentElement.dataset.theme = name;
    viewer.theme = THEMES[name];
    stale.is = true;
  };
  const system = matchMedia("(prefers-color-scheme: dark)");
  theme(system.matches ? "dark" : "light");
  system.addEventListener("change", () => theme(system.matches ? "dark" : "light"));
  const views = {
    overview: () => camera.reset(),
    side: () => camera.look([0.6, 0, 0.4], -Math.PI / 2, 0.12, 2.6),
    top: () => camera.look([0.6, 0, 0.3], -Math.PI / 2, 1.49, 3.6),
    eyes: () => { eyes = true; stale.is = true; },
  };
  const look = (name) => { eyes = false; views[name](); };
  for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => look(button.dataset.view));
  $("theme").addEventListener("click", () => theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
  // Moving the camera ends the view through the person's eyes.
  const outside = (name) => (...way) => { eyes = false; camera[name](...way); };
  steer(canvas, { orbit: outside("orbit"), zoom: outside("zoom"), pan: outside("pan") }, takes, claiming);
  addEventListener("resize", () => { stale.is = true; });
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const name = { 1: "overview", 2: "side", 3: "top", 4: "eyes" }[event.key];
    if (name) look(name);
  });
  let lost = false;
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault();
    lost = true;
    notice("The graphics card was lost", "Reload the page to go on.");
  });

  /** A camera in the person's head. */
  const asPerson = ({ head, gaze, predicted }) => {
    const way = gaze?.direction ?? (predicted ? unit(sub(predicted.point, head)) : [-1, 0, 0]);
    const view = lookAt(head, add(head, way));
    return { matrices: (aspect) => ({ projection: perspective(1.15, aspect, 0.03, 80), view, eye: head }) };
  };

  return {
    camera, viewer, canvas, stale, look,
    /** Composes and draws. */
    show(frame) {
      if (lost) return;
      const within = eyes && frame.head;
      camera.base = frame.base?.at ?? [0, 0, 0];
      viewer.compose({ ...frame, eye: frame.head, head: within ? null : frame.head });
      const clip = viewer.render(within ? asPerson(frame) : camera);
      labels.show(viewer.labels, clip);
      stale.is = false;
    },
    /** Numbers of a frame. */
    tell(frame) {
      const { name, rgb } = scene.states[frame.state] ?? { name: "unknown", rgb: [128, 128, 128] };
      // During a touch, both have arrived.
      const touched = frame.state === TOUCHED, coming = frame.goal && !touched;
      const lead = coming ? leadOf(frame) : null, force = frame.force ? norm(frame.force) : 0;
      const rows = {
        time: seconds(frame.t),
        hand: frame.hand ? "tracked" : "lost",
        contact: touched ? "–" : seconds(frame.predicted?.time),
        left: coming ? seconds(frame.left) : "–",
        lead: lead == null ? "–" : `${lead >= 0 ? "+" : "−"}${Math.abs(lead).toFixed(2)} s`,
        force: force > LEAST_FORCE ? `${force.toFixed(1)} N` : "–",
      };
      $("state").lastElementChild.textContent = name;
      $("state").firstElementChild.style.background = `rgb(${rgb})`;
      for (const [id, text] of Object.entries(rows)) $(id).textContent = text;
      $("hand").className = frame.hand ? "" : "late";
      $("lead").className = lead != null && lead < 0 ? "late" : "";
    },
  };
}

/** Something that the reader must know, over the picture; without words it goes away. */
function notice(title, text = "") {
  const box = $("notice");
  box.hidden = !title;
  box.replaceChildren(Object.assign(document.createElement("b"), { textContent: title ?? "" }), text);
}
