// The live page: shows the session and errors; a pointer or a headset is a hand.
const TOLD = 6;
/** Counts of the server that are samples of a hand that it did not use. */
const DROPPED = ["stale", "out_of_order", "duplicate", "malformed", "looking_on", "other_hand", "uncalibrated", "clock_leaps", "overflow"];

/** This headset, as far as a page can tell: a number that its browser keeps. A calibration is of one headset. */
function headsetId() {
  const name = "hwall-headset";
  try { const kept = Number(localStorage.getItem(name)); if (Number.isSafeInteger(kept) && kept > 0) return kept; } catch { /* one for this visit */ }
  const [high, low] = crypto.getRandomValues(new Uint32Array(2)), id = (high % 2 ** 21) * 2 ** 32 + low || 1;
  try { localStorage.setItem(name, id); } catch { /* as above */ }
  return id;
}

function live() {
  const key = new URLSearchParams(location.search).get("key");
  const address = `${location.protocol === "https:" ? "wss:" : "ws:"}//${location.host}/ws${key ? `?key=${encodeURIComponent(key)}` : ""}`;
  const id = headsetId();
  let shown = null, scene = null, sceneText = null, pointer = null, headset = null, newest = null, fresh = false;
  let preparing = "waiting for the room", connection = null, setup = null, offered = null, sent = 0, rate = 0, state = "connecting", retry = 0, leads = true, framed = 0;

  const tell = (t, text) => {
    const line = document.createElement("li"), time = document.createElement("time");
    time.textContent = t == null ? "" : `${t.toFixed(2)} s`;
    line.append(time, text);
    $("log").prepend(line);
    while ($("log").children.length > TOLD) $("log").lastChild.remove();
    $("log").hidden = false;
  };

  // Said once there is a connection again: until then the server believes the old place of the space.
  let moved = false;
  const recentred = () => { moved = !connection.order("calibrate", { step: "recentred" }); };

  /** A page is a headset's once it was in VR: a desktop's browser offers VR, too, and whoever sits before it may still press Take. */
  let worn = false;
  const introduce = () => { if (worn) connection.put({ type: "headset", id }); };

  const begin = (message) => {
    scene = message;
    shown = stage(scene, (event) => pointer?.takes(event) ?? null, () => touching);
    shown.viewer.stops = true;
    const send = (sample) => connection.hand(sample);
    pointer = new PointerHand(shown, scene, send);
    headset = new Headset(shown, scene, {
      send: (sample) => { sent += sample.side === "right" ? 1 : 0; return send(sample); }, newest: () => newest,
      recentred,
      pinched: (side) => calibration.pinch(side),
      words: () => calibration.words(headset),
      begins: (onFloor) => {
        worn = true;
        introduce();
        pointer.on = false;
        $("vr").textContent = "Leave VR";
        if (!onFloor) tell(newest?.t, "VR: the headset does not know its floor; hands are off by the height of the head");
      },
      ends: () => { pointer.on = touching; $("vr").textContent = "Enter VR"; shown.stale.is = true; },
    });
    mode(true);
    Headset.offered().then((is) => {
      offered = is;
      $("vr").hidden = !is;
      $("checks").open = is || !isSecureContext;
    });
    if (calibration.told) calibration.tell(calibration.told);
    shown.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      tell(newest?.t, "the picture was lost; it is made again");
    });
    // What was uploaded is gone with the old picture.
    shown.canvas.addEventListener("webglcontextrestored", () => location.reload());
    requestAnimationFrame(tick);
    window.hwall = { ...shown, pointer, headset, calibration, connection: () => connection, newest: () => newest };
  };

  let touching = true, held = "somebody stopped it, or an input is missing or wrong";
  const mode = (is) => {
    touching = is;
    if (pointer && !headset?.session) pointer.on = is;
    $("touching").setAttribute("aria-pressed", String(is));
    $("looking").setAttribute("aria-pressed", String(!is));
    $("view").classList.toggle("touching", is);
    $("hint").textContent = is
      ? "Point at the wall: the person looks there. Hold the button (or a finger) to touch. Turn the picture with the right button, or with two fingers."
      : "Drag to turn, wheel or two fingers to come nearer, shift-drag to shift.";
  };
  $("touching").addEventListener("click", () => mode(true));
  $("looking").addEventListener("click", () => mode(false));
  $("stop").addEventListener("click", () => connection.order("stop"));
  $("release").addEventListener("click", () => {
    if (confirm(`The arm stands: ${held}.\nIs everybody clear of it? It moves again when you let it go.`)) connection.order("release");
  });
  /** A button that requests something while it is pressed. The request is repeated, so that sending stops when the page closes. */
  const requests = (id, order, changed) => {
    let asking = null;
    const toggle = () => {
      if (!shown) return;
      const is = asking === null, ask = () => connection.order(order);
      if (is) { ask(); asking = setInterval(ask, 500); } else { clearInterval(asking); asking = null; }
      changed(is);
      $(id).setAttribute("aria-pressed", String(is));
    };
    $(id).addEventListener("click", toggle);
    return toggle;
  };
  const parts = requests("parts", "parts", (is) => { shown.viewer.showsParts = is; shown.stale.is = true; });
  const explain = requests("explained", "explain", (is) => { $("why").textContent = "no hand has been predicted yet"; $("why").hidden = !is; });
  addEventListener("keydown", (event) => {
    // Whatever the layout, and with Caps Lock.
    if (event.code === "KeyS" || event.key.toLowerCase() === "s") connection.order("stop");
    const toggle = { b: parts, e: explain }[event.key];
    if (toggle && !event.repeat && !event.ctrlKey && !event.metaKey && !event.altKey) toggle();
  });
  if (location.hash === "#switch") {
    // An enabling switch. While it is held it reports twenty times a second; when it is released it stops the arm.
    const button = $("switch");
    let timer = null;
    const letGo = () => {
      if (timer === null) return;
      clearInterval(timer);
      timer = null;
      button.classList.remove("held");
      connection.order("stop");
    };
    button.hidden = false;
    button.addEventListener("pointerdown", () => {
      if (timer !== null) return;
      const says = () => connection.order("enable");
      says();
      timer = setInterval(says, 50);
      button.classList.add("held");
    });
    for (const event of ["pointerup", "pointercancel", "pointerleave"]) button.addEventListener(event, letGo);
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    addEventListener("blur", letGo);
    document.addEventListener("visibilitychange", letGo);
  }
  $("vr").addEventListener("click", async () => {
    if (headset.session) { headset.leave(); return; }
    try { await headset.enter(await kind(calibration.told?.corner != null)); } catch (error) { tell(null, `VR: ${error.message}`); }
  });

  // Opaque VR shows the board where the calibration says that it is; only a touch of the real one checks that.
  const kind = async (isTouched) => (isTouched && (await Headset.offered("immersive-ar")) ? "immersive-ar" : "immersive-vr");
  const enters = async () => {
    if (headset?.session || !offered) return false;
    try { await headset.enter(await kind(true)); return true; } catch (error) { tell(null, `VR: ${error.message}`); return false; }
  };
  const calibration = new Calibration({
    order: (step) => connection.order("calibrate", { step }),
    enters,
    placed: (pose) => headset?.place(pose),
    touched: (count, target) => {
      if (!headset) return;
      headset.target = target;
      if (count === "none") headset.marks = [];
      if (count === "one more") headset.mark(calibration.told.side);
    },
  });
  const checks = new Checks();
  const check = () => {
    const now = performance.now(), { trip, offset } = connection, session = headset?.session ?? null;
    const hands = ["left", "right"].map((side) => now - (headset?.seen[side] ?? -Infinity));
    checks.show(checksOf({
      secure: isSecureContext, protocol: location.protocol, setup, offered, session, onFloor: headset?.onFloor ?? null, hands, trip, offset, rate,
      calibration: calibration.told,
    }));
  };
  setInterval(() => { rate = 0.5 * rate + 0.5 * sent; sent = 0; check(); }, 1000);

  const says = {
    setup: (message) => { setup = message; },
    calibration: (message) => calibration.tell(message),
    event: ({ t, kind, text }) => {
      if (kind === "held" || kind === "safe") held = text;
      if (shown && ["unreachable", "goal", "arrived", "touched"].includes(kind)) shown.viewer.beyond = kind === "unreachable" ? text : null;
      tell(t, text ? `${kind}: ${text}` : kind);
    },
    // The indentation is for a console.
    explanation: ({ text }) => { $("why").textContent = text.replace(/^ +/gm, ""); },
    preparing: ({ text }) => { preparing = text; },
    error: ({ text }) => tell(null, `server: ${text}`),
    counts: (counts) => {
      leads = counts.leads !== false;
      const dropped = DROPPED.reduce((sum, name) => sum + (counts[name] ?? 0), 0);
      $("counts").textContent = `${counts.accepted ?? 0} taken, ${dropped} dropped`;
    },
    scene: (message) => {
      // A calibration may have moved the headset's space since.
      const text = JSON.stringify({ ...message, base_from_headset: null });
      if (!shown) { sceneText = text; begin(message); }
      // Another room: start anew.
      else if (text !== sceneText) location.reload();
    },
  };

  connection = new Connection(address, {
    state: (is, ms = 0) => {
      state = is;
      retry = performance.now() + ms;
      if (is === "lost") tell(newest?.t, "connection lost");
      if (is === "open" && shown) tell(newest?.t, "connected again");
      if (is === "open") introduce();
      if (is === "open" && moved) recentred();
      if (is !== "open") newest = newest && { ...newest, hand: null, predicted: null };
      if (shown) shown.stale.is = true;
    },
    text: (message, text) => {
      try { says[message.type]?.(message, text); } catch (error) {
        console.error(error);
        notice("This cannot be shown", String(error.message ?? error));
      }
    },
    bytes: (data) => {
      try { [newest] = decodeFrame(new DataView(data), 0); framed = performance.now(); fresh = true; } catch (error) { tell(null, String(error.message)); }
    },
  });

  /** What is wrong, in the middle of the picture. */
  const complain = () => {
    const now = performance.now();
    const name = state === "open" ? (newest && now - framed > 1500 ? "no pictures" : "connected") : state === "lost" ? "lost" : "connecting";
    $("server").textContent = name;
    $("server").className = name === "connected" ? "" : "late";
    $("trip").textContent = connection.trip == null ? "–" : `${connection.trip.toFixed(1)} ms`;
    $("release").hidden = newest?.state !== SAFE;
    if (state === "lost") notice("Connection lost", `Trying again in ${Math.max(0, (retry - now) / 1000).toFixed(1)} s. The arm holds still until a hand is seen again.${key ? " If the bridge was started again, open the address that it prints now: its key is new." : ""}`);
    else if (state === "connecting") notice(shown ? "Reconnecting …" : "Connecting …", location.host);
    else if (!shown) notice("Preparing", preparing);
    else if (newest && now - framed > 1500) notice("No pictures from the server", "It is connected, but has sent nothing new for a while.");
    else if (newest?.state === SAFE || (newest?.state === HOLDING && newest.hand)) notice("The arm stands", held);
    else if (newest?.inFront) notice("The arm is in front of a wall", `A part that you cannot see in VR is ${Math.round(1000 * newest.inFront.by)} mm in front: keep your hands away.`);
    else if (!leads && pointer.at) notice("Somebody else's hand is followed", "It is your turn once theirs has rested for a while.");
    else notice(null);
  };
  setInterval(complain, 200);

  function tick() {
    requestAnimationFrame(tick);
    // A headset draws its own frames.
    if (!newest || headset.session || !(fresh || shown.stale.is)) return;
    fresh = false;
    shown.show(newest);
    shown.tell(newest);
  }
}

live();
