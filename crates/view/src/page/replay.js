// Replays frames: play, speed, a track of states to scrub on.
const MARKS = { touched: "#c21f2d", released: "#8a94a0", arrived: "#009e73", late: "#d55e00", lost: "#cc79a7", held: "#785e3c" };

function replay(scene, frames, markers) {
  if (!frames.length) throw new Error("This replay holds no frames.");
  const shown = stage(scene);
  const start = frames[0].t, end = frames[frames.length - 1].t;
  const track = $("track");
  let now = start, playing = true, last = 0, drawn = null;

  /** Index of the last frame not after `t`. */
  const indexAt = (t) => {
    let low = 0, high = frames.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (frames[middle].t <= t) low = middle; else high = middle - 1;
    }
    return low;
  };
  const frameAt = (t) => {
    const i = indexAt(t), a = frames[i], b = frames[i + 1];
    // Do not interpolate over a gap.
    return b && b.t - a.t < 0.3 && b.t > a.t ? between(a, b, clamp((t - a.t) / (b.t - a.t), 0, 1)) : a;
  };
  const seek = (t) => { now = clamp(t, start, end); shown.stale.is = true; };
  const play = (is) => {
    if (is && now >= end) now = start;
    playing = is;
    $("play").querySelector("path").setAttribute("d", is ? "M3 2h4v12H3zM9 2h4v12H9z" : "M3 1.5v13l11-6.5z");
    $("play").setAttribute("aria-label", is ? "Pause" : "Play");
    shown.stale.is = true;
  };

  function paint() {
    const ratio = devicePixelRatio || 1, w = Math.max(1, Math.round(track.clientWidth * ratio)), h = Math.max(1, Math.round(track.clientHeight * ratio));
    if (track.width !== w || track.height !== h) { Object.assign(track, { width: w, height: h }); drawn = null; }
    const c = track.getContext("2d"), style = getComputedStyle(document.documentElement);
    const x = (t) => (end > start ? ((t - start) / (end - start)) * w : 0);
    if (!drawn || drawn.theme !== document.documentElement.dataset.theme) {
      drawn = { theme: document.documentElement.dataset.theme, picture: new OffscreenCanvas(w, h) };
      const d = drawn.picture.getContext("2d"), top = 13 * ratio;
      for (let i = 0; i < frames.length;) {
        let j = i;
        while (j < frames.length && frames[j].state === frames[i].state) j++;
        d.fillStyle = `rgb(${scene.states[frames[i].state].rgb})`;
        d.fillRect(x(frames[i].t), top, Math.max(1, x(frames[Math.min(j, frames.length - 1)].t) - x(frames[i].t)), h - 2 * top);
        i = j;
      }
      d.font = `${10.5 * ratio}px system-ui, sans-serif`;
      d.fillStyle = style.getPropertyValue("--faint");
      d.textAlign = "center";
      const step = [0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600].find((s) => x(start + s) > 46 * ratio) ?? 600;
      for (let t = 0; t <= end - start; t += step) {
        d.fillRect(x(start + t), h - top, ratio, 3 * ratio);
        d.fillText(`${t} s`, clamp(x(start + t), 10 * ratio, w - 14 * ratio), h - 0.5 * ratio);
      }
      for (const mark of markers) {
        const at = x(mark.t), high = 10 * ratio, wide = 4.5 * ratio;
        d.fillStyle = MARKS[mark.kind] ?? "#888";
        d.beginPath();
        d.moveTo(at, top); d.lineTo(at - wide, top - high); d.lineTo(at + wide, top - high);
        d.fill();
      }
    }
    c.clearRect(0, 0, w, h);
    c.drawImage(drawn.picture, 0, 0);
    c.fillStyle = style.getPropertyValue("--ink");
    c.fillRect(x(now) - 1.25 * ratio, 2 * ratio, 2.5 * ratio, h - 13 * ratio);
    c.beginPath(); c.arc(x(now), 5 * ratio, 5 * ratio, 0, 2 * Math.PI); c.fill();
  }

  const scrub = (event) => seek(start + (clamp((event.clientX - track.getBoundingClientRect().left) / track.clientWidth, 0, 1)) * (end - start));
  track.addEventListener("pointerdown", (event) => { track.setPointerCapture(event.pointerId); play(false); scrub(event); });
  track.addEventListener("pointermove", (event) => {
    if (event.buttons) scrub(event);
    const t = start + ((event.clientX - track.getBoundingClientRect().left) / track.clientWidth) * (end - start);
    const near = markers.filter((m) => Math.abs(m.t - t) < (end - start) * 0.006);
    track.title = [scene.states[frames[indexAt(t)].state].name, ...near.map((m) => `${(m.t - start).toFixed(2)} s: ${m.text}`)].join("\n");
  });
  $("play").addEventListener("click", () => play(!playing));
  // Start one second before a touch.
  const touches = markers.filter((m) => m.kind === "touched").map((m) => m.t - 1);
  const next = () => { const t = touches.find((t) => t > now + 0.05); if (t != null) seek(t); };
  const previous = () => { const t = touches.filter((t) => t < now - 0.3).pop(); seek(t ?? start); };
  $("next").addEventListener("click", next);
  $("previous").addEventListener("click", previous);
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target instanceof HTMLSelectElement) return;
    const step = event.shiftKey ? 1 : 1 / 30;
    const does = { " ": () => play(!playing), ArrowRight: () => { play(false); seek(now + step); }, ArrowLeft: () => { play(false); seek(now - step); }, Home: () => seek(start), End: () => seek(end), n: next, p: previous }[event.key];
    if (!does) return;
    event.preventDefault();
    document.activeElement?.blur?.();
    does();
  });
  const used = [...new Set(frames.map((f) => f.state))].sort((a, b) => a - b);
  $("key").replaceChildren(...used.map((state) => {
    const entry = document.createElement("span"), chip = document.createElement("i");
    chip.style.background = `rgb(${scene.states[state].rgb})`;
    entry.append(chip, scene.states[state].name);
    return entry;
  }));

  function tick(ms) {
    requestAnimationFrame(tick);
    const step = last ? Math.min((ms - last) / 1000, 0.25) : 0;
    last = ms;
    if (playing) {
      now += step * Number($("speed").value);
      if (now >= end) { now = end; play(false); }
    }
    if (!playing && !shown.stale.is) return;
    const frame = placed(frameAt(now));
    shown.show(frame);
    shown.tell({ ...frame, t: frame.t - start });
    $("clock").textContent = `${(now - start).toFixed(2)} / ${(end - start).toFixed(1)} s`;
    paint();
    counted.pictures += 1;
  }
  const counted = { pictures: 0 };
  play(true);
  requestAnimationFrame(tick);
  // For tests and scripts.
  window.hwall = { seek: (t) => { play(false); seek(start + t); }, play, now: () => now - start, counted, look: shown.look, ...shown };
}

try {
  const scene = JSON.parse($("scene").textContent);
  replay(scene, decodeFrames(bytesOfBase64($("frames").textContent)), JSON.parse($("markers").textContent));
} catch (error) {
  notice("This cannot be shown", String(error.message ?? error));
  console.error(error);
}
