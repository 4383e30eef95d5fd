// The live page: its maps, what they have in common, and what is asked of all of them.

import { drawScale } from "./drawing.js";
import { locate } from "./frames.js";
import { Card } from "./card.js";
import { element } from "./elements.js";
import { Link } from "./link.js";
import { Panel } from "./panel.js";
import { tools } from "./tools.js";

const MOST = 6;
const SETTLED = 300; // milliseconds

export class Explorer {
  constructor(root, carrier, start, remember) {
    this.root = root;
    this.link = new Link(carrier);
    this.remember = remember;
    this.cards = [];
    Object.assign(this, {
      region: start.region, measure: start.measure, ellipses: start.ellipses ?? false,
      isolines: start.isolines ?? true, spacing: start.spacing ?? 46, names: start.names ?? [], countries: start.countries ?? [],
    });
    this.build();
    for (const projection of start.projections) this.add(projection);
    this.sizes = new ResizeObserver(() => this.redraw());
    this.sizes.observe(this.grid);
    this.darkness = matchMedia("(prefers-color-scheme: dark)");
    this.redrawn = () => this.redraw();
    this.darkness.addEventListener("change", this.redrawn);
  }

  close() {
    this.sizes.disconnect();
    this.darkness.removeEventListener("change", this.redrawn);
    for (const card of this.cards) clearTimeout(card.resting);
  }

  // What is set from elsewhere, as in a notebook's kernel.
  follow({ projections, region, measure }) {
    this.measure = measure;
    if (this.menu.value !== measure) {
      this.menu.value = measure;
      this.redraw();
    }
    if (region !== this.region) this.useRegion(region); // which is right, as the kernel has read it
    projections.forEach((definition, k) => (this.cards[k] ? this.cards[k].open(definition) : this.add(definition)));
    if (this.cards.length === projections.length) return;
    for (const card of this.cards.splice(projections.length)) card.node.remove();
    this.count();
  }

  build() {
    this.menu = element("select", { id: "measure" });
    this.menu.addEventListener("change", () => {
      this.measure = this.menu.value;
      this.redraw();
      this.rememberSoon();
    });
    this.bar = element("canvas", { id: "scale" });
    this.bar.setAttribute("role", "img");
    this.place = element("input", { id: "region", value: this.region, spellcheck: false, autocomplete: "off", list: "regions" });
    const places = element("form", { className: "place" }, [
      element("label", { htmlFor: "region", textContent: "Region" }), this.place, element("button", { type: "submit", textContent: "Go" }),
    ]);
    places.addEventListener("submit", (event) => {
      event.preventDefault();
      this.setRegion(this.place.value);
    });
    this.place.addEventListener("change", () => this.setRegion(this.place.value));
    this.place.addEventListener("focus", () => this.place.select());
    places.append(this.atlas());
    this.status = element("p", { className: "said", id: "status" });
    this.status.setAttribute("role", "status");
    this.spoken = element("p", { className: "spoken", id: "spoken" });
    this.spoken.setAttribute("aria-live", "polite");
    this.grid = element("section", { className: "maps" });
    this.grid.setAttribute("aria-label", "Maps");
    this.panel = new Panel(this);
    const check = (name, text) => {
      const box = element("input", { type: "checkbox", id: name, checked: this[name] });
      box.addEventListener("change", () => {
        this[name] = box.checked;
        this.redraw();
        this.remembered();
      });
      return element("label", {}, [box, ` ${text}`]);
    };
    const spacing = element("input", { type: "range", id: "spacing", min: 24, max: 120, value: this.spacing });
    spacing.addEventListener("input", () => {
      this.spacing = Number(spacing.value);
      this.redraw();
      this.settled();
    });
    const more = element("button", { type: "button", textContent: "Add a map" });
    more.addEventListener("click", () => this.add(this.cards.at(-1)?.definition ?? "winkel-tripel"));
    this.root.replaceChildren(
      element("header", {}, [
        element("h1", { textContent: "projdist explore" }), places,
        element("div", { className: "measure" }, [
          element("label", { htmlFor: "measure", textContent: "Measure" }), this.menu, this.bar,
        ]),
        element("div", { className: "switches" }, [
          check("isolines", "Isolines"), check("ellipses", "Indicatrices"),
          element("label", {}, ["Apart ", spacing]), more, ...tools(this),
        ]),
        this.status, this.spoken,
      ]),
      this.grid, this.panel.node,
      element("p", { className: "help", id: "help", textContent:
        "Drag a map to turn it, or press Alt and the arrow keys. Point at it, or move with the arrows (faster with " +
        "Shift), for the distortion there: h and k are the scales along meridian and parallel, a and b the largest and " +
        "the smallest. Figures after ~ are those of a preview, good to a few per cent. Boxes and circles are drawn with " +
        "the keys, too: Enter at one end and at the other; Escape puts the tool away." }),
      element("datalist", { id: "projections" }, this.names.map((value) => element("option", { value }))),
      element("datalist", { id: "regions" }, this.countries.map((value) => element("option", { value }))),
    );
  }

  // ---- maps ---------------------------------------------------------------------------------

  add(definition, beside, words) {
    if (this.cards.length >= MOST) {
      this.say(`A page holds at most ${MOST} maps. Remove one first.`);
      return beside;
    }
    const card = new Card(this, definition, words);
    const at = beside ? this.cards.indexOf(beside) + 1 : this.cards.length;
    this.cards.splice(at, 0, card);
    if (beside) beside.node.after(card.node);
    else this.grid.append(card.node);
    this.count();
    return card;
  }

  remove(card) {
    if (this.cards.length === 1) return this.say("One map must stay on the page.");
    this.cards.splice(this.cards.indexOf(card), 1);
    card.node.remove();
    this.count();
    this.remembered();
    this.cards[0].canvas.focus();
  }

  count() {
    this.grid.dataset.count = this.cards.length;
    this.redraw();
  }

  // A region that is none is said, and the one before stays.
  setRegion(given) {
    const text = given.trim();
    if (text === "") return;
    const answer = ({ problem }) => {
      this.say(problem ?? "");
      this.place.toggleAttribute("aria-invalid", Boolean(problem));
      if (!problem && text !== this.region) this.useRegion(text);
    };
    this.place.value = text;
    if (text === this.region) answer({});
    else this.link.ask("scales", "region", { region: text }, answer);
  }

  useRegion(text) {
    this.region = this.place.value = text;
    for (const card of this.cards) card.resolved = null;
    this.panel.forget();
    for (const card of this.cards) card.changed(false);
  }

  // The regions that have names, as a menu: a field shows only those that begin as what stands in it.
  atlas() {
    const menu = element("select", { id: "atlas" }, [new Option("Choose…", "")]);
    menu.setAttribute("aria-label", "Choose a region");
    const groups = new Map();
    for (const value of this.countries) {
      const [kind, name] = value.includes(":") ? value.split(":") : ["world", value];
      if (!groups.has(kind)) groups.set(kind, element("optgroup", { label: { country: "Countries", continent: "Continents", state: "States of the USA" }[kind] ?? "World" }));
      groups.get(kind).append(new Option(name, value));
    }
    menu.append(...["world", "continent", "country", "state"].map((kind) => groups.get(kind)).filter(Boolean));
    menu.addEventListener("change", () => {
      this.setRegion(menu.value);
      menu.value = "";
    });
    return menu;
  }

  say(text) {
    this.status.textContent = text;
  }

  // The colours of all maps; those of previews stay as they are.
  rescale({ scales, together }) {
    if (!scales.length) return;
    this.scales = scales;
    const all = this.cards.map((card) => card.resolved).filter(Boolean);
    // Pictures that were on their way at the same time do not know of each other.
    if (all.some((one) => !together.includes(one)) && !this.scaling) {
      this.scaling = true;
      this.link.ask("scales", "page", { region: this.region, beside: all }, (block) => {
        this.scaling = false;
        if (!block.problem) this.rescale({ ...block, together: all });
      });
    }
    if (this.menu.length !== scales.length) {
      this.menu.replaceChildren(...scales.map((one) => new Option(one.label, one.name)));
    }
    const known = scales.some((one) => one.name === this.measure);
    this.menu.value = known ? this.measure : scales[0].name;
    this.measure = this.menu.value;
    this.redraw();
  }

  redraw() {
    this.scale = this.scales?.find((one) => one.name === this.measure);
    if (!this.scale) return;
    const [low, high] = this.scale.limits.map((end) => end.toPrecision(3));
    this.bar.setAttribute("aria-label", `${this.scale.label}, ${low} to ${high}`);
    drawScale(this.bar, this.scale);
    cancelAnimationFrame(this.waiting);
    this.waiting = requestAnimationFrame(() => this.cards.forEach((card) => card.draw()));
  }

  settled() {
    this.panel.draw();
    this.rememberSoon();
  }

  // To write an address takes longer than to draw a map.
  rememberSoon() {
    clearTimeout(this.settling);
    this.settling = setTimeout(() => this.remembered(), SETTLED);
  }

  remembered() {
    const { region, measure, ellipses, isolines, spacing } = this;
    this.remember({ projections: this.cards.map((card) => card.definition), region, measure, ellipses, isolines, spacing });
  }

  // ---- one cursor for all maps --------------------------------------------------------------

  look(card, here) {
    this.cursor = here && { card, lon: here.lon, lat: here.lat };
    for (const other of this.cards) {
      if (!other.view) continue;
      other.tell(other === card || here === null ? here : locate(other.view.frame, here.lon, here.lat));
    }
  }

  leave() {
    this.cursor = null;
    for (const card of this.cards) card.tell(null);
  }

  // What is known of the cursor's place on a map that has just been drawn.
  placeOn({ view }) {
    return this.cursor && locate(view.frame, this.cursor.lon, this.cursor.lat);
  }

  // Said to who does not see it, when the keys rest.
  read(card) {
    clearTimeout(this.reading);
    this.reading = setTimeout(() => (this.spoken.textContent = card.told.textContent || "Not on the map."), SETTLED);
  }

  shapes(shapes) {
    for (const card of this.cards) {
      if (!card.view) continue;
      card.view.shapes = shapes;
      card.view.show(card.probed);
    }
  }

  // ---- the way to the server ----------------------------------------------------------------

  lost() {
    this.link.forget();
    this.scaling = false;
    this.panel.lost();
    this.say("The server does not answer. This page continues when it does.");
  }

  refused() {
    this.say("Another server answers here now. Open the address that its command printed.");
  }

  found() {
    this.say("");
    for (const card of this.cards) {
      card.onItsWay = card.again = false;
      card.changed(false);
    }
  }
}
