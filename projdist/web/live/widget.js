// The explorer in a notebook: messages to the kernel in place of a socket, and what both sides may set.

import { Explorer } from "./explore.js";
import { STYLE } from "./style.js";

const PATIENCE = 2500; // milliseconds
const DARK = "(prefers-color-scheme: dark)";
const SET = ["projections", "region", "measure"];

// Messages of one view: all views of a widget hear all of its messages.
class Messages {
  constructor(model, late) {
    Object.assign(this, { model, late, view: crypto.getRandomValues(new Uint32Array(1))[0] });
    this.hear = ({ view }, buffers) => {
      if (view !== this.view) return;
      this.heard();
      const { buffer, byteOffset, byteLength } = buffers[0];
      this.received(buffer.slice(byteOffset, byteOffset + byteLength));
    };
    model.on("msg:custom", this.hear);
  }

  async send(text, file) {
    const bytes = file ? [await file.arrayBuffer()] : [];
    this.model.send({ view: this.view, text }, undefined, bytes);
    // Previews are answered at once, but for a kernel that runs a cell.
    if (text.includes('"kind":"preview"')) this.waiting ??= setTimeout(() => this.late(true), PATIENCE);
  }

  heard() {
    clearTimeout(this.waiting);
    this.waiting = null;
    this.late(false);
  }

  close() {
    clearTimeout(this.waiting);
    this.model.off("msg:custom", this.hear);
    this.model.send({ view: this.view, closed: true });
  }
}

// Of the notebook, which need not be as the system is.
function isDark() {
  const { dataset, classList } = document.body;
  if (dataset.jpThemeLight) return dataset.jpThemeLight === "false";
  if (["dark", "dark-theme", "vscode-dark"].some((name) => classList.contains(name))) return true;
  if (["light", "light-theme", "vscode-light"].some((name) => classList.contains(name))) return false;
  return matchMedia(DARK).matches;
}

function render({ model, el }) {
  const host = document.createElement("div"), style = document.createElement("style"), root = document.createElement("div");
  root.className = "projdist-explore";
  root.dataset.carrier = "notebook";
  // Names and styles of the page are its own, and keys that it hears are no commands of the notebook.
  host.attachShadow({ mode: "open" }).append(style, root);
  host.dataset.lmSuppressShortcuts = "true";
  for (const event of ["keydown", "keyup", "keypress"]) host.addEventListener(event, (key) => key.stopPropagation());
  el.append(host);
  let explorer = null;
  const dress = () => {
    const dark = isDark();
    if (host.dataset.dark === String(dark)) return;
    host.dataset.dark = dark;
    root.style.colorScheme = dark ? "dark" : "light";
    style.textContent = STYLE.replaceAll(DARK, dark ? "all" : "not all");
    explorer?.redraw();
  };
  dress();
  const dresses = new MutationObserver(dress);
  dresses.observe(document.body, { attributes: true });
  const messages = new Messages(model, (late) => {
    if (late) explorer.say("The kernel is busy. The maps follow when it answers.");
    else if (explorer.status.textContent.startsWith("The kernel is busy")) explorer.say("");
  });
  const stated = () => Object.fromEntries(SET.map((name) => [name, model.get(name)]));
  const remember = (view) => {
    for (const name of SET) {
      if (JSON.stringify(view[name]) !== JSON.stringify(model.get(name))) model.set(name, view[name]);
    }
    model.save_changes();
  };
  explorer = new Explorer(root, messages, { ...stated(), ...model.get("_words") }, remember);
  const follow = () => explorer.follow(stated());
  for (const name of SET) model.on(`change:${name}`, follow);
  return () => {
    for (const name of SET) model.off(`change:${name}`, follow);
    dresses.disconnect();
    messages.close();
    explorer.close();
  };
}

export default { render };
