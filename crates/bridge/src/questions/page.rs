//! The page itself.

/// Everything in one file: it asks nobody but its own server.
pub(super) const PAGE: &str = r##"<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Question</title>
<style>
  :root { color-scheme: light dark; font: 22px/1.4 system-ui, sans-serif; }
  body { margin: 0; min-height: 100vh; display: grid; place-items: center; background: Canvas; color: CanvasText; }
  main { width: min(44rem, 92vw); text-align: center; }
  h1 { font-size: 1.6rem; font-weight: 600; }
  #answers { display: flex; flex-wrap: wrap; gap: 1rem; justify-content: center; }
  button { font: inherit; font-size: 1.5rem; min-width: 5rem; min-height: 5rem; padding: 0 1.4rem; border-radius: 1rem; border: 2px solid #1d4ed8; background: #1d4ed8; color: white; }
  button:disabled { opacity: 0.4; }
  button:focus-visible, input:focus-visible { outline: 4px solid #f59e0b; outline-offset: 3px; }
  input { font: inherit; font-size: 2rem; width: 9rem; text-align: center; border-radius: 1rem; border: 2px solid #64748b; padding: 0.6rem; }
</style>
<main>
  <h1 id="text" role="status" aria-live="polite">One moment</h1>
  <form id="answers"></form>
</main>
<script>
"use strict";
const text = document.getElementById("text"), answers = document.getElementById("answers");
let socket, question = null;
const button = (label, value) => {
  const made = document.createElement("button");
  made.type = value === null ? "submit" : "button";
  made.textContent = label;
  if (value !== null) made.addEventListener("click", () => answer(value));
  return made;
};
function answer(value) {
  if (!question || !(value > 0) || !Number.isFinite(value)) return;
  socket.send(JSON.stringify({ type: "answer", id: question.id, value }));
  question = null;
  for (const part of answers.elements) part.disabled = true;
}
answers.addEventListener("submit", (event) => {
  event.preventDefault();
  const typed = answers.querySelector("input");
  if (typed) answer(Number(typed.value.replace(",", ".")));
});
function show(told) {
  text.textContent = told.text;
  question = told.type === "question" ? told : null;
  answers.replaceChildren();
  if (!question) return;
  if (told.kind === "number") {
    const typed = document.createElement("input");
    typed.inputMode = "decimal";
    typed.autocomplete = "off";
    typed.setAttribute("aria-label", "your number");
    answers.append(typed, button("Answer", null));
    typed.focus();
  } else if (told.kind === "scale") {
    for (let point = 1; point <= told.points; point++) answers.append(button(String(point), point));
  } else if (told.kind === "two") answers.append(button("First", 1), button("Second", 2));
  else answers.append(button("Go on", 1));
}
addEventListener("keydown", (event) => {
  if (!question || question.kind === "number" || event.repeat) return;
  const points = question.kind === "scale" ? question.points : question.kind === "two" ? 2 : 0;
  const value = Number(event.key);
  if (Number.isInteger(value) && value >= 1 && value <= points) answer(value);
});
function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`);
  socket.onmessage = ({ data }) => show(JSON.parse(data));
  socket.onclose = () => { show({ type: "status", text: "Not connected" }); setTimeout(connect, 1000); };
}
connect();
</script>
</html>
"##;
