// Beside the maps: the best CRSs for the region, maps by their errors of angles and areas, and data that is checked.

import { element } from "./elements.js";
import { scatter } from "./scatter.js";

const PURPOSES = ["any", "conformal", "equal-area", "equidistant", "compromise"];
const SLOT = "page";

export class Panel {
  constructor(page) {
    this.page = page;
    this.rows = [];
    this.build();
  }

  build() {
    this.purpose = element("select", { id: "purpose" }, PURPOSES.map((name) => new Option(name, name)));
    this.find = element("button", { type: "button", textContent: "Find the best CRSs" });
    this.find.addEventListener("click", () => this.recommend());
    this.stop = element("button", { type: "button", textContent: "Stop", hidden: true });
    this.stop.addEventListener("click", () => {
      this.page.link.stop("recommend", SLOT);
      this.working(false, "Stopped.");
    });
    this.progress = element("progress", { hidden: true });
    this.progress.setAttribute("aria-label", "Maps measured");
    this.said = element("p", { className: "said" });
    this.said.setAttribute("role", "status");
    this.list = element("div", { className: "table" });
    this.plot = element("div", { className: "scatter" });
    this.file = element("input", { type: "file", id: "file", accept: ".geojson,.json" });
    this.file.addEventListener("change", () => this.file.files[0] && this.check(this.file.files[0]));
    this.worst = element("div", { className: "table" });
    const drop = element("div", { className: "drop" }, [
      element("label", { htmlFor: "file", textContent: "GeoJSON to check in the first map (or drop it here) " }), this.file,
    ]);
    drop.addEventListener("dragover", (event) => event.preventDefault());
    drop.addEventListener("drop", (event) => {
      event.preventDefault();
      if (event.dataTransfer.files[0]) this.check(event.dataTransfer.files[0]);
    });
    this.node = element("section", { className: "panel" }, [
      element("div", { className: "best" }, [
        element("h2", { textContent: "Best existing maps of the region" }),
        element("p", { className: "buttons" }, [
          element("label", { htmlFor: "purpose", textContent: "Purpose" }), this.purpose, this.find, this.stop, this.progress,
        ]),
        this.said, this.list,
      ]),
      element("div", {}, [element("h2", { textContent: "Angles against areas" }), this.plot]),
      element("div", {}, [element("h2", { textContent: "Your data" }), drop, this.worst]),
    ]);
    this.node.setAttribute("aria-label", "Advice");
  }

  forget() {
    this.rows = [];
    this.list.replaceChildren();
    this.said.textContent = "";
    this.draw();
  }

  lost() {
    if (this.find.disabled) this.working(false, "Not finished: the server does not answer.");
    if (this.checking) this.worst.replaceChildren();
    this.checking = false;
  }

  working(busy, text = "") {
    this.find.disabled = busy;
    this.stop.hidden = this.progress.hidden = !busy;
    this.progress.removeAttribute("value");
    this.said.textContent = text;
  }

  recommend() {
    const { page } = this;
    this.working(true);
    page.link.ask("recommend", SLOT, { region: page.region, options: { purpose: this.purpose.value } }, (block) => {
      if (block.progress) {
        [this.progress.value, this.progress.max] = block.progress;
        return;
      }
      this.working(false, block.problem ?? [...block.notes, `${block.candidates} CRSs were looked at.`].join(" "));
      this.rows = block.rows ?? [];
      this.list.replaceChildren(table(["CRS", "name", "AK error", "largest scale error", "share", ""], this.rows.map((row) => [
        row.definition,
        `${row.name}${row.national ? " (national)" : ""}`,
        row.value.toPrecision(3),
        scaleError(row.largest),
        `${(100 * row.share).toFixed(0)} %`,
        this.opener(row.definition),
      ])));
      this.draw();
    });
  }

  opener(definition) {
    const button = element("button", { type: "button", textContent: "Show" });
    button.setAttribute("aria-label", `Show ${definition}`);
    button.addEventListener("click", () => this.page.add(definition));
    return button;
  }

  // The maps of the page, and those of the list.
  draw() {
    const points = this.page.cards.filter((card) => card.figures?.angles != null && card.figures.areas != null).map((card) => (
      { name: card.title.textContent, x: card.figures.angles, y: card.figures.areas, work: () => card.canvas.focus(), kind: "own" }
    ));
    for (const { definition, name, angles, areas } of this.rows) {
      if (angles == null || areas == null) continue;
      points.push({ name: `${definition} ${name}`, x: angles, y: areas, work: () => this.page.add(definition), kind: "other" });
    }
    this.plot.replaceChildren(points.length ? scatter(points) : element("p", { textContent: "No map has finite errors of both." }));
  }

  check(file) {
    const { page } = this, card = page.cards[0];
    this.checking = true;
    this.worst.replaceChildren(element("p", { textContent: `Checking ${file.name}…` }));
    page.link.ask("check", SLOT, { ...card.asked }, (block) => {
      if (block.progress) return;
      this.checking = false;
      if (block.problem) return this.worst.replaceChildren(element("p", { textContent: block.problem }));
      let start = 0;
      const lines = Array.from(block.sizes, (size) => {
        const line = Array.from({ length: size }, (_, k) => [block.points[2 * (start + k)], block.points[2 * (start + k) + 1]]);
        start += size;
        return line;
      });
      page.shapes([{ lines }]);
      const per = (value) => (value === null ? "" : `${(100 * value).toPrecision(3)} %`);
      const rows = block.rows.map((row, k) => {
        const show = element("button", { type: "button", textContent: "Show" });
        show.setAttribute("aria-label", `Show feature ${row.index}`);
        show.addEventListener("click", () => page.shapes([{ lines: [lines[k]] }]));
        return [`${row.index} ${row.name ?? ""}`, per(row.area_error), per(row.length_error),
          row.bearing_error === null ? "" : `${row.bearing_error.toPrecision(3)}°`, show];
      });
      this.worst.replaceChildren(
        element("p", { textContent: `The worst of ${block.count} features of ${file.name} in ${card.title.textContent}. ${block.notes.join(" ")}` }),
        table(["feature", "area error", "length error", "bearing RMS", ""], rows),
      );
    }, file);
  }
}

function scaleError(ppm) {
  if (ppm === null) return "infinite";
  if (ppm >= 1e4) return `${(ppm / 1e4).toPrecision(3)} %`;
  return `${ppm >= 100 ? ppm.toFixed(0) : ppm.toPrecision(2)} ppm`;
}

function table(heads, rows) {
  const cell = (name, content) => element(name, name === "th" ? { scope: "col" } : {}, [content]);
  return element("table", {}, [
    element("thead", {}, [element("tr", {}, heads.map((head) => cell(head ? "th" : "td", head)))]),
    element("tbody", {}, rows.map((row) => element("tr", {}, row.map((content) => cell("td", content))))),
  ]);
}
