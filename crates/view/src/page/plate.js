// A plate before the eyes of who wears the headset: the words of the page are not seen there.

const PLATE_VERTEX = `#version 300 es
uniform mat4 u_clip;
out vec2 v_at;
void main() {
  v_at = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = u_clip * vec4(v_at - 0.5, 0.0, 1.0);
}`;

const PLATE_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D u_words;
in vec2 v_at;
out vec4 colour;
void main() { colour = texture(u_words, vec2(v_at.x, 1.0 - v_at.y)); }`;

/** Size of the picture, pixels; shortest time between two pictures, ms. */
const PLATE_W = 768, PLATE_H = 360, PLATE_MS = 100;
/** In the frame of the eyes: 0.36 m wide, above the middle of the view, where it hides no board. By columns. */
const PLATE_POSE = [0.36, 0, 0, 0, 0, 0.169, 0, 0, 0, 0, 1, 0, 0, 0.15, -0.7, 1];
const TONES = { next: "#f0b429", good: "#2e9e5b", wrong: "#e0503c" };

class Plate {
  constructor(gl) {
    Object.assign(this, { gl, words: null, text: null, drawn: -Infinity });
    this.program = program(gl, PLATE_VERTEX, PLATE_FRAGMENT);
    this.array = gl.createVertexArray();
    this.texture = gl.createTexture();
    this.canvas = Object.assign(document.createElement("canvas"), { width: PLATE_W, height: PLATE_H });
  }

  /** Shows these words from now on: `title`, `far`, `text`, `tone`, and `corners` with their tones; `null`: nothing. */
  say(words) {
    const text = JSON.stringify(words), now = performance.now();
    if (text === this.text || (words && now - this.drawn < PLATE_MS)) return;
    Object.assign(this, { words, text, drawn: now });
    if (words) this.picture(words);
  }

  picture({ title, far, text, tone, corners }) {
    const { gl, canvas } = this, pen = canvas.getContext("2d");
    pen.fillStyle = "#13171d";
    pen.fillRect(0, 0, PLATE_W, PLATE_H);
    pen.fillStyle = TONES[tone];
    pen.fillRect(0, 0, PLATE_W, 10);
    const left = corners.length ? 230 : 30, line = (words, size, y, colour) => {
      pen.font = `600 ${size}px system-ui, sans-serif`;
      pen.fillStyle = colour;
      for (const word of words.split(" ").reduce((lines, next) => {
        const longer = `${lines.at(-1)} ${next}`.trim();
        return pen.measureText(longer).width > PLATE_W - left - 20 ? [...lines, next] : [...lines.slice(0, -1), longer];
      }, [""])) { pen.fillText(word, left, y); y += 1.25 * size; }
      return y;
    };
    line(text, 25, line(far, 32, line(title, 38, 66, "#ffffff"), TONES[tone]), "#c9d1da");
    // The board from the front.
    if (corners.length) { pen.strokeStyle = "#9aa7b5"; pen.lineWidth = 4; pen.strokeRect(50, 90, 140, 140); }
    corners.forEach(({ right, up, tone: dot }, i) => {
      pen.fillStyle = TONES[dot] ?? "#5b6672";
      pen.beginPath();
      pen.arc(120 + 70 * right, 160 - 70 * up, dot === "next" ? 26 : 18, 0, 2 * Math.PI);
      pen.fill();
      pen.font = "600 24px system-ui, sans-serif";
      pen.fillStyle = "#13171d";
      pen.fillText(`${i + 1}`, 113 + 70 * right, 169 - 70 * up);
    });
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, canvas);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  }

  /** Draws it over all else. `eyes`: pose of the head in the space of `clip`. */
  draw(clip, eyes) {
    if (!this.words) return;
    const { gl, program: { made, at } } = this;
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.useProgram(made);
    gl.uniformMatrix4fv(at.u_clip, false, multiply(clip, multiply(eyes, PLATE_POSE)));
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.bindVertexArray(this.array);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.bindVertexArray(null);
  }
}
