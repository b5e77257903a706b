// What must hold before somebody enters VR, each with what to do if it does not.

/** A hand counts as seen for this long, ms; fewest samples a second of a headset; longest round trip, ms. */
const SEEN_MS = 1000, FEWEST_HZ = 50, SLOW_MS = 80;
const MARKS = { ok: "✓", wait: "…", do: "!" };

/** The list: name, state (ok, wait, do), words. `facts` are what the page knows. */
function checksOf({ secure, protocol, setup, offered, session, onFloor, hands, trip, offset, rate, calibration }) {
  const localhost = secure && protocol === "http:";
  const seen = hands.filter((ms) => ms < SEEN_MS).length;
  return [
    ["secure context", ...(secure ? ["ok", localhost ? "localhost counts as one" : "HTTPS"] : ["do", "start the bridge with --tls and open the HTTPS address that it prints, with its key, or use a cable and adb reverse, and open localhost:8080"])],
    ["certificate", ...(localhost ? ["ok", "none needed on localhost"] : !secure ? ["do", "none without HTTPS: see above"] : !setup ? ["wait", "asking the server"]
      : ["ok", setup.self_signed ? `self-signed, accepted; compare ${setup.fingerprint?.slice(0, 11)} … with the console` : "your own"])],
    ["VR", ...(offered ? ["ok", session ? "on" : "offered"] : offered === null ? ["wait", "asking the browser"] : ["do", secure ? "this browser offers none: use the headset's own" : "needs a secure context"])],
    ["floor", ...(onFloor === null ? ["wait", "known once VR begins"] : onFloor ? ["ok", "known"] : ["do", "draw the boundary in the headset's settings; without it hands are off by the height of the head"])],
    ["hands", ...(seen ? ["ok", seen === 2 ? "both seen" : "one seen"] : session ? ["do", "put the controllers down and hold a hand in view; hand tracking must be on"] : ["wait", "shown once VR begins"])],
    ["clock", ...(offset === null ? ["wait", "asking the server"] : trip > SLOW_MS ? ["do", `a round trip takes ${trip.toFixed(0)} ms: come nearer to the router, or use its 5 GHz band`] : ["ok", `offset known within ${(trip / 2).toFixed(1)} ms`])],
    ["samples", ...(!session ? ["wait", "counted once VR begins"] : rate >= FEWEST_HZ ? ["ok", `${rate.toFixed(0)} a second`] : ["do", `${rate.toFixed(0)} a second: close other pages and programs`])],
    ["calibration", ...(!calibration ? ["wait", "asking the server"] : calibration.state === "good" ? ["ok", calibration.text] : calibration.state === "free" ? ["wait", `${calibration.text}; Calibrate finds it by three touches`] : ["do", calibration.text])],
  ];
}

/** Shows the list whenever it changes. */
class Checks {
  constructor() { this.shown = ""; }

  show(list) {
    const text = JSON.stringify(list);
    if (text === this.shown) return;
    this.shown = text;
    const left = list.filter(([, state]) => state === "do").length, waits = list.filter(([, state]) => state === "wait").length;
    $("ready").textContent = left ? `${left} to do` : waits ? `${waits} to come` : "all is well";
    $("list").replaceChildren(...list.map(([name, state, words]) => {
      const line = document.createElement("li"), mark = document.createElement("i"), title = document.createElement("b");
      line.className = state;
      mark.textContent = MARKS[state];
      title.textContent = name;
      line.append(mark, title, words);
      return line;
    }));
  }
}
