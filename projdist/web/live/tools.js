// What is drawn on maps with the pointer: a box, a circle, and the region that is moved about.

import { element } from "./elements.js";
import { box, boxBetween, circle, distance, moved } from "./sphere.js";

// A tool has `down`, `move` and `up`, with the map and the place on it; while it is there, maps are not dragged.
class Drawing {
  constructor(page, shape, region) {
    Object.assign(this, { page, shape, region });
  }

  down(card, [x, y]) {
    const found = card.view.probe(x, y);
    this.from = found && [found.lon, found.lat];
  }

  move(card, [x, y]) {
    if (!this.from) return false;
    const found = card.view.probe(x, y);
    if (found) {
      this.to = [found.lon, found.lat];
      this.page.shapes([{ lines: [this.shape(this.from, this.to)] }]);
    }
    return true;
  }

  // With the keys: one end, and the other.
  press(card, place) {
    if (this.from) this.up();
    else this.down(card, place);
  }

  up() {
    const { from, to } = this;
    this.from = this.to = null;
    this.page.shapes([]);
    if (!from || !to || distance(from, to) < 1e-3) return;
    this.page.choose(null);
    this.page.setRegion(this.region(from, to));
  }

  end() {
    this.page.shapes([]);
  }
}

class Moving {
  constructor(page) {
    this.page = page;
    page.link.ask("outline", "page", { region: page.region }, (block) => {
      if (block.problem) {
        page.choose(null);
        return page.say(block.problem);
      }
      this.middle = block.middle;
      this.lines = [];
      let start = 0;
      for (const size of block.sizes) {
        this.lines.push(Array.from({ length: size }, (_, k) => [block.points[2 * (start + k)], block.points[2 * (start + k) + 1]]));
        start += size;
      }
      page.say(`${block.title}: drag it over a map.`);
      page.shapes([{ lines: this.lines }]);
    });
  }

  down(card, place) {
    this.held = true;
    this.move(card, place);
  }

  move(card, [x, y]) {
    if (!this.held || !this.lines) return false;
    const found = card.view.probe(x, y);
    if (found) this.page.shapes([{ lines: moved(this.lines, this.middle, [found.lon, found.lat]) }]);
    return false;
  }

  press(card, place) {
    this.held = !this.held;
    this.move(card, place);
  }

  up() {
    this.held = false;
  }

  end() {
    this.page.shapes([]);
    this.page.say("");
  }
}

const number = (value) => String(Math.round(value * 1000) / 1000);

const KINDS = {
  "Draw a box": (page) => new Drawing(page, (from, to) => box(boxBetween(from, to)),
    (from, to) => `box:${boxBetween(from, to).map(number).join(",")}`),
  "Draw a circle": (page) => new Drawing(page, (from, to) => circle(from, distance(from, to)),
    (from, to) => `cap:${number(from[0])},${number(from[1])},${Math.max(1, Math.round(distance(from, to)))}`),
  "Move the region": (page) => new Moving(page),
};

// Buttons that choose a tool, or none.
export function tools(page) {
  const buttons = Object.keys(KINDS).map((name) => {
    const button = element("button", { type: "button", textContent: name });
    button.setAttribute("aria-pressed", "false");
    button.addEventListener("click", () => page.choose(button.getAttribute("aria-pressed") === "true" ? null : name));
    return button;
  });
  page.choose = (name) => {
    page.tool?.end();
    page.tool = null;
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.textContent === name));
    page.root.dataset.tool = name ?? "";
    if (name) page.tool = KINDS[name](page);
  };
  page.root.addEventListener("keydown", (event) => event.key === "Escape" && page.choose(null));
  return buttons;
}
