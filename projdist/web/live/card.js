// One map of the page: its picture, what moves it, its parameters and its figures.

import { readFrame } from "./frames.js";
import { told } from "./measures.js";
import { LiveView } from "./view.js";
import { element, download, copyText } from "./elements.js";

const REST = 120; // milliseconds without a change before the exact picture is asked for
const DEGREE = 180 / Math.PI;
const FORMATS = ["png", "svg", "pdf", "html"];
const CODE = /^\w+:\w+$/;
const TILT = "lat_c";
let count = 0;

export class Card {
  constructor(page, definition, words = "") {
    this.page = page;
    this.link = page.link;
    this.slot = `map${++count}`;
    this.definition = definition;
    this.values = {};
    this.centre = null;
    this.words = words;
    this.version = 0;
    this.build();
    this.changed(false);
  }

  // ---- what is asked ------------------------------------------------------------------------

  get asked() {
    return { projection: this.definition, values: this.values, centre: this.centre, region: this.page.region };
  }

  // What the map is has changed: a preview at once, and the picture when nothing changes any more.
  changed(moving = true) {
    this.node.dataset.version = ++this.version;
    this.figures = null;
    this.node.setAttribute("aria-busy", "true");
    if (moving) {
      this.words = "";
      this.preview();
    }
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.picture(), moving ? REST : 0);
  }

  preview() {
    if (this.onItsWay) {
      this.again = true;
      return;
    }
    this.onItsWay = true;
    const asked = this.version;
    this.link.ask("preview", this.slot, this.asked, (block) => {
      this.onItsWay = false;
      if (this.again) {
        this.again = false;
        this.preview();
      }
      if (block.problem) return this.say(block.problem);
      if (this.shown > asked) return;
      this.put(block, asked);
      this.tellAbout(block.about);
    });
  }

  picture() {
    const asked = this.version;
    const beside = this.page.cards.filter((card) => card !== this).map((card) => card.resolved).filter(Boolean);
    this.link.ask("picture", this.slot, { ...this.asked, beside }, (block, wait) => {
      if (asked !== this.version) return;
      this.node.setAttribute("aria-busy", "false");
      this.node.dataset.wait = Math.round(wait);
      if (block.problem) return this.refused(block.problem);
      Object.assign(this, { definition: block.definition, resolved: block.resolved, values: {}, centre: null });
      this.good = block.definition;
      this.input.removeAttribute("aria-invalid");
      this.parameterRanges(block);
      this.titled(block);
      this.measure(asked, block.region_title);
      this.say([this.words, ...block.notes].filter(Boolean).join(" "));
      this.copies();
      this.page.rescale(block);
      this.put(block, asked + 0.5);
      this.page.settled();
    });
  }

  // The last picture stays, and what is done next is done to its map; what was typed can be mended.
  refused(problem) {
    this.say(problem);
    if (this.good === undefined || this.good === this.definition) return;
    Object.assign(this, { definition: this.good, values: {}, centre: null });
    this.input.setAttribute("aria-invalid", "true");
  }

  measure(asked, region) {
    this.about.textContent ||= "Measuring…";
    this.link.ask("figures", this.slot, this.asked, ({ problem, figures }) => {
      if (asked !== this.version) return;
      this.figures = figures;
      this.tellFigures(problem ? { reason: problem } : figures, region);
      this.page.settled();
    });
  }

  // Versions are told to who watches the page; the exact picture of one comes half a version later.
  put(block, version) {
    this.node.dataset.shown = this.shown = version;
    const frame = readFrame(block);
    if (this.view) this.view.put(frame);
    else this.view = new LiveView(this.canvas, frame);
    this.draw();
  }

  draw() {
    if (!this.view || !this.page.scale) return;
    const { scale, ellipses, isolines } = this.page;
    this.view.draw(scale, ellipses && { spacing: this.page.spacing }, isolines);
    if (this.pointed) this.look(...this.pointed);
    else if (!this.dragged) this.tell(this.page.placeOn(this));
  }

  // ---- what is seen -------------------------------------------------------------------------

  build() {
    const id = this.slot;
    this.input = element("input", { id: `${id}-name`, value: this.definition, spellcheck: false, autocomplete: "off", list: "projections" });
    this.canvas = element("canvas", { className: "map", tabIndex: 0, id: `${id}-map` });
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-labelledby", `${id}-title`);
    this.canvas.setAttribute("aria-describedby", "help");
    this.title = element("h2", { id: `${id}-title`, textContent: this.definition });
    this.told = element("p", { className: "told" });
    this.said = element("p", { className: "said", id: `${id}-said` });
    this.said.setAttribute("role", "status");
    this.input.setAttribute("aria-describedby", this.said.id);
    this.about = element("p", { className: "figures" });
    this.sliders = element("div", { className: "sliders" });
    const form = element("form", { className: "name" }, [
      element("label", { htmlFor: this.input.id, textContent: "Projection" }), this.input,
      element("button", { type: "submit", textContent: "Show" }),
    ]);
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.open(this.input.value);
    });
    this.input.addEventListener("change", () => this.open(this.input.value));
    this.input.addEventListener("focus", () => this.input.select());
    this.texts = element("div", { className: "texts" });
    this.copying = this.folded("Copy and save", element("div", {}, [this.saving(), this.texts]), false, () => this.copies());
    this.node = element("article", { className: "card", id }, [
      this.title, form, this.canvas, this.told, this.about, this.said,
      this.folded("Parameters", this.sliders, true),
      this.copying,
      this.folded("Improve", this.improving(), false),
    ]);
    this.node.setAttribute("aria-labelledby", this.title.id);
    this.listen();
  }

  folded(name, content, open, opened) {
    const node = element("details", { open }, [element("summary", { textContent: name }), content]);
    if (opened) node.addEventListener("toggle", () => node.open && opened());
    return node;
  }

  open(definition) {
    if (definition.trim() === "" || definition.trim() === this.definition) return;
    Object.assign(this, { definition: definition.trim(), values: {}, centre: null, words: "" });
    this.changed(false);
  }

  say(text) {
    this.said.textContent = text;
    if (text) this.node.setAttribute("aria-busy", "false");
  }

  tellAbout(about) {
    this.about.textContent = about ? `Airy-Kavrayskiy error about ${about.airy_kavrayskiy.toPrecision(2)} (a preview)` : "";
  }

  titled({ name, definition }) {
    this.title.textContent = CODE.test(definition) ? `${name} (${definition})` : name;
    this.input.value = definition;
  }

  tellFigures(figures, region) {
    if (figures.reason) {
      this.about.textContent = figures.reason;
      return;
    }
    const value = (figure) => (figure === null ? "infinite" : certainly(figure, figures.error));
    const covered = figures.coverage < 0.9995 ? ` It shows ${(100 * figures.coverage).toFixed(1)} % of it.` : "";
    this.about.textContent =
      `Airy-Kavrayskiy error over ${region === "globe" ? "the globe" : region}: ${value(figures.airy_kavrayskiy)}; at the best scale ` +
      `${value(figures.airy_kavrayskiy_scaled)}, of which angles ${value(figures.angles)}, areas ${value(figures.areas)}; ` +
      `after the best linear correction ${value(figures.airy_kavrayskiy_affine)} ` +
      `(each ± ${figures.error === null ? "?" : figures.error.toPrecision(1)}).${covered} ${figures.note}`;
  }

  // Sliders of the parameters; those that are there are kept, so that the one in use stays.
  parameterRanges({ parameters, drags, centre }) {
    this.drags = drags;
    this.middle = centre;
    // Maps that are turned have no parameter of PROJ for it.
    if (drags === "both" && !parameters.some((one) => one.name === "lat_0")) {
      parameters.push({ name: TILT, label: "Latitude of the centre", unit: "°", low: -90, high: 90, step: 1, value: centre[1] });
    }
    const names = parameters.map((one) => one.name).join(" ");
    if (names !== this.sliders.dataset.names) {
      this.sliders.dataset.names = names;
      this.sliders.replaceChildren(...parameters.map((one) => this.slider(one)));
      if (!parameters.length) this.sliders.textContent = "This map has no parameters that change it.";
    }
    for (const one of parameters) {
      const [slider, number] = this.sliders.querySelectorAll(`[data-name="${one.name}"]`);
      for (const input of [slider, number]) {
        if (input === this.node.getRootNode().activeElement && this.turning) continue;
        Object.assign(input, { min: one.low, max: one.high });
        input.value = one.value;
      }
    }
  }

  slider({ name, label, unit, low, high, step, value }) {
    const id = `${this.slot}-${name}`, of = { min: low, max: high, step: "any", value };
    const slider = element("input", { type: "range", id, ...of, step });
    const number = element("input", { type: "number", ...of });
    number.setAttribute("aria-label", `${label} (${name})`);
    for (const input of [slider, number]) input.dataset.name = name;
    const turn = (input, other) => input.addEventListener("input", () => {
      if (input.value === "" || !input.checkValidity()) return;
      this.turning = true;
      other.value = input.value;
      this.turn(name, Number(input.value));
    });
    turn(slider, number);
    turn(number, slider);
    for (const input of [slider, number]) input.addEventListener("change", () => (this.turning = false));
    const text = element("label", { htmlFor: id, textContent: `${label}${unit ? ` (${unit})` : ""}` });
    if (name !== TILT) text.append(" ", element("code", { textContent: name }));
    return element("div", { className: "slider" }, [text, slider, number]);
  }

  turn(name, value) {
    if (name === TILT || (name === "lon_0" && this.drags === "both" && this.centre)) {
      this.centre = this.middle = name === TILT ? [this.middle[0], value] : [value, this.middle[1]];
    } else this.values[name] = value;
    this.changed();
  }

  saving() {
    const buttons = FORMATS.map((format) => {
      const button = element("button", { type: "button", textContent: `Save ${format.toUpperCase()}` });
      button.addEventListener("click", () => this.save(format));
      return button;
    });
    const canvas = element("button", { type: "button", textContent: "Save what is seen" });
    canvas.addEventListener("click", () => this.canvas.toBlob((blob) => download(blob, "projdist-view.png")));
    return element("p", { className: "buttons" }, [canvas, ...buttons]);
  }

  save(format) {
    this.say("Drawing…");
    const { measure, ellipses } = this.page;
    this.link.ask("export", this.slot, { ...this.asked, options: { format, measure, ellipses } }, (block) => {
      if (block.progress) return;
      this.say(block.problem ?? `Saved ${block.name}.`);
      if (!block.problem) download(new Blob([block.file]), block.name);
    });
  }

  copies() {
    if (!this.copying.open) return;
    this.link.ask("texts", this.slot, this.asked, (block) => {
      if (block.problem) return this.say(block.problem);
      this.texts.replaceChildren(...Object.entries(block.texts).map(([name, text]) => copyText(name, text)));
    });
  }

  improving() {
    const button = (name, work) => {
      const node = element("button", { type: "button", textContent: name });
      node.addEventListener("click", work);
      return node;
    };
    const study = (kind, options = {}) => () => {
      this.say("Working…");
      this.link.ask(kind, this.slot, { ...this.asked, options }, (block) => {
        if (block.progress) {
          const [done, all] = block.progress;
          return this.say(all ? `Working: ${done} of ${all}.` : "Working…");
        }
        if (block.problem) return this.say(block.problem);
        this.say("");
        const before = block.before === null ? "unknown" : block.before.toPrecision(4);
        const words = `${block.words} The Airy-Kavrayskiy error is ${block.after.toPrecision(4)}, before ${before}.`;
        this.page.add(block.definition, this, words);
      });
    };
    return element("p", { className: "buttons" }, [
      button("Correct linearly", study("correct")),
      button("Design a map for the region", study("design", { kind: "any" })),
      button("Design, conformal", study("design", { kind: "conformal" })),
      button("Stop", () => ["correct", "design"].forEach((kind) => this.link.stop(kind, this.slot)) ?? this.say("Stopped.")),
      button("Duplicate", () => this.page.add(this.definition, this)),
      button("Remove", () => this.page.remove(this)),
    ]);
  }

  // ---- what is done with the pointer and the keys -------------------------------------------

  listen() {
    const canvas = this.canvas, place = (event) => [event.offsetX, event.offsetY];
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !this.view) return;
      canvas.setPointerCapture(event.pointerId);
      if (this.page.tool) return this.page.tool.down(this, place(event));
      // A finger does not point before it touches.
      if (event.pointerType === "touch") this.look(...place(event));
      if (!this.middle || this.drags === "none") return;
      this.dragged = { from: place(event), middle: this.middle, zoom: this.view.zoom / this.view.ratio };
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!this.view) return;
      if (this.page.tool?.move(this, place(event))) return;
      if (this.dragged) return this.drag(place(event));
      this.pointed = place(event);
      this.look(...this.pointed);
    });
    const end = () => (this.dragged = null);
    canvas.addEventListener("pointerup", (event) => {
      this.page.tool?.up(this, place(event));
      end();
    });
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("pointerleave", ({ pointerType }) => {
      this.pointed = null;
      if (!this.dragged && pointerType !== "touch") this.page.leave();
    });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }

  drag([x, y]) {
    const { from, middle, zoom } = this.dragged, radius = this.view.frame.radius;
    const east = ((x - from[0]) / zoom / radius) * DEGREE, north = ((from[1] - y) / zoom / radius) * DEGREE;
    if (Math.abs(x - from[0]) + Math.abs(y - from[1]) < 3) return;
    this.pointed = null;
    this.page.leave();
    const lat = this.drags === "both" ? Math.max(-90, Math.min(90, middle[1] - north)) : middle[1];
    const lon = middle[0] - east / Math.max(Math.cos(((this.drags === "both" ? middle[1] : 0) * Math.PI) / 180), 0.2);
    this.moveTo([rounded(lon - 360 * Math.round(lon / 360)), rounded(lat)]);
  }

  moveTo(centre) {
    this.centre = this.middle = centre;
    for (const [name, value] of [["lon_0", centre[0]], ["lat_0", centre[1]], [TILT, centre[1]]]) {
      delete this.values[name];
      for (const input of this.sliders.querySelectorAll(`[data-name="${name}"]`)) input.value = value;
    }
    this.changed();
  }

  key(event) {
    if (event.key === "Escape" && this.dragged) {
      const { middle } = this.dragged;
      this.dragged = null;
      return this.moveTo(middle);
    }
    if (event.key === "Enter" && this.page.tool && this.at) return this.page.tool.press(this, this.at);
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!way || !this.view) return;
    event.preventDefault();
    if (event.altKey || event.ctrlKey || event.metaKey) {
      if (!this.middle || this.drags === "none") return;
      const [lon, lat] = this.middle, turned = lon + 5 * way[0];
      const tilted = this.drags === "both" ? Math.max(-90, Math.min(90, lat - 5 * way[1])) : lat;
      this.moveTo([turned - 360 * Math.round(turned / 360), tilted]);
      return;
    }
    const { clientWidth: width, clientHeight: height } = this.canvas, step = width / (event.shiftKey ? 20 : 100);
    const [x, y] = this.at ?? [width / 2, height / 2], within = (value, size) => Math.max(0, Math.min(size - 1, value));
    this.look(within(x + step * way[0], width), within(y + step * way[1], height));
    this.page.tool?.move(this, this.at);
    this.page.read(this);
  }

  look(x, y) {
    this.at = [x, y];
    this.page.look(this, this.view.probe(x, y));
  }

  // What is known of a place of this map.
  tell(probed) {
    this.probed = probed;
    this.view?.show(probed);
    this.told.textContent = probed ? textOf(probed, this.view) : "";
  }
}

const rounded = (value) => Math.round(value * 100) / 100;

function certainly(figure, error) {
  const decimals = Math.max(1, Math.min(8, Math.floor(-Math.log10(2 * (error || 1e-8)))));
  return figure.toFixed(figure < 1e-3 ? Math.min(8, decimals + 2) : decimals);
}

function textOf(probed, view) {
  const degrees = (value, [positive, negative]) =>
    `${Math.abs(value).toFixed(view.decimals)}° ${value < 0 ? negative : positive}`;
  const figures = Object.entries(told(probed, view.frame.mirrored)).map(([name, value]) => `${name}\u00a0${value}`);
  const rough = probed.rough || view.frame.preview ? "~ " : "";
  return `${degrees(probed.lat, "NS")} ${degrees(probed.lon, "EW")}: ${rough}${figures.join(", ")}`;
}
