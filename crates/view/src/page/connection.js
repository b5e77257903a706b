// The connection to the server: reconnects, estimates its clock, detects its silence.

/** First and longest pause before another attempt, ms; silence that counts as a loss, ms. */
const PAUSE_MS = 250, LONGEST_PAUSE_MS = 5000, SILENT_MS = 4000;
/** While more than this waits to be sent, bytes, a sample or a held switch would be old by the time it arrives: it is left out. An order never is. */
const MOST_WAITING = 32768, ONLY_NOW = ["hand", "enable"];

class Connection {
  constructor(url, { text, bytes, state }) {
    Object.assign(this, { url, text, bytes, state, pause: PAUSE_MS, seq: 0, pings: 0, trip: null, offset: null, left_out: 0 });
    setInterval(() => this.watch(), 1000);
    // A headset that was taken off and put on again need not wait for the next attempt.
    document.addEventListener("visibilitychange", () => { if (!document.hidden && !this.socket) this.open(); });
    this.open();
  }

  open() {
    clearTimeout(this.attempt);
    this.state("connecting");
    this.heard = performance.now();
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => { this.pause = PAUSE_MS; this.heard = performance.now(); this.state("open"); this.ping(); };
    socket.onmessage = ({ data }) => {
      this.heard = performance.now();
      if (typeof data !== "string") { this.bytes(data); return; }
      let message;
      try { message = JSON.parse(data); } catch { return; }
      if (message.type === "pong") this.pong(message); else this.text(message, data);
    };
    socket.onclose = () => { if (this.socket === socket) this.again(); };
  }

  again() {
    this.socket = null;
    this.trip = this.offset = null;
    const ms = this.pause * (0.75 + 0.5 * Math.random());
    this.pause = Math.min(2 * this.pause, LONGEST_PAUSE_MS);
    this.state("lost", ms);
    this.attempt = setTimeout(() => this.open(), ms);
  }

  watch() {
    const { socket } = this;
    if (!socket) return;
    if (performance.now() - this.heard > SILENT_MS) {
      // The socket died silently: the headset slept, or the network changed.
      socket.onclose = socket.onmessage = null;
      socket.close();
      this.again();
    } else this.ping();
  }

  ping() { this.put({ type: "ping", id: ++this.pings, client_ms: performance.now() }); }

  pong({ client_ms: sent, server_ms: there }) {
    const now = performance.now(), trip = now - sent;
    // The fastest reply gives the best offset; older ones fade.
    this.best = Math.min(trip, (this.best ?? Infinity) + 0.2);
    this.trip = trip;
    if (trip <= this.best) this.offset = there - (sent + trip / 2);
  }

  put(message) {
    const { socket } = this;
    if (socket?.readyState !== WebSocket.OPEN) return false;
    if (ONLY_NOW.includes(message.type) && socket.bufferedAmount > MOST_WAITING) { this.left_out += 1; return false; }
    socket.send(JSON.stringify(message));
    return true;
  }

  /** What a person asks of the arm: "stop" or "release"; `more`: a step of a calibration. */
  order(type, more = {}) { return this.put({ type, ...more }); }

  /** A sample of a hand; numbers rise over all sources. */
  hand(sample) { return this.put({ ...sample, seq: ++this.seq }); }
}
