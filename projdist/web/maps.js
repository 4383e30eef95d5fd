// The maps of a report: drawn, and told at a place.

import { inflate, locate, probe, readBlock, readFrame } from "./frames.js";
import { MapView, drawScale } from "./drawing.js";
import { told } from "./measures.js";

const byId = (id) => document.getElementById(id);

await drawMaps();

async function drawMaps() {
  const { measure, scales } = JSON.parse(byId("scales").textContent);
  const views = [];
  for (const canvas of document.querySelectorAll("canvas.map")) {
    const text = byId(canvas.id.replace("map", "frame")).textContent;
    views.push(new MapView(canvas, readFrame(readBlock(await inflate(text)))));
  }
  const menu = byId("measure"), ellipses = byId("ellipses"), bar = byId("scale");
  menu.append(...grouped(scales, measure));
  document.querySelector(".bar").hidden = byId("help").hidden = false;
  const redraw = () => {
    const scale = scales.find((one) => one.name === menu.value);
    bar.setAttribute("aria-label", `${scale.label}, ${scale.limits.map((end) => end.toPrecision(3)).join(" to ")}`);
    drawScale(bar, scale);
    for (const view of views) view.draw(scale, ellipses.checked, true);
  };
  menu.addEventListener("change", redraw);
  ellipses.addEventListener("change", redraw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  addEventListener("resize", later(redraw));
  addEventListener("beforeprint", () => {
    document.documentElement.dataset.print = "yes";
    redraw();
  });
  addEventListener("afterprint", () => {
    delete document.documentElement.dataset.print;
    redraw();
  });
  for (const view of views) listen(view, views);
  redraw();
}

// The choices of the menu in their groups.
function grouped(scales, chosen) {
  const groups = new Map();
  for (const { group, label, name } of scales) {
    if (!groups.has(group)) groups.set(group, Object.assign(document.createElement("optgroup"), { label: group }));
    groups.get(group).append(new Option(label, name, name === chosen, name === chosen));
  }
  return groups.values();
}

// Once, after the last of many calls.
function later(work) {
  let waiting;
  return () => {
    cancelAnimationFrame(waiting);
    waiting = requestAnimationFrame(work);
  };
}

function listen(view, views) {
  const canvas = view.canvas;
  let at = null;
  const look = (px, py) => {
    at = [px, py];
    tell(view, views, px, py);
  };
  canvas.addEventListener("pointermove", (event) => look(event.offsetX * view.ratio, event.offsetY * view.ratio));
  canvas.addEventListener("pointerdown", (event) => look(event.offsetX * view.ratio, event.offsetY * view.ratio));
  canvas.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!way) return;
    event.preventDefault();
    const step = canvas.width / (event.shiftKey ? 20 : 100), [x, y] = at ?? [canvas.width / 2, canvas.height / 2];
    const within = (value, size) => Math.max(0, Math.min(size - 1, value));
    look(within(x + step * way[0], canvas.width), within(y + step * way[1], canvas.height));
  });
}

// The same place on all maps; on the others as far as it is in a whole cell of theirs.
function tell(view, views, px, py) {
  const frame = view.frame, triangle = view.at(px, py), [x, y] = view.steps(px, py);
  const decimals = Math.max(0, Math.min(6, Math.ceil(-Math.log10(Math.abs(frame.v[2] - frame.v[1]) / 100))));
  const here = triangle < 0 ? null : { ...probe(frame, triangle, x, y, decimals), x, y };
  for (const other of views) {
    const there = other === view || here === null ? here : locate(other.frame, here.lon, here.lat);
    other.show(there);
    byId(other.canvas.id.replace("map", "told")).textContent = textOf(there, other.frame, decimals);
  }
}

function textOf(probed, frame, decimals) {
  if (probed === null) return "";
  const place = `${degrees(probed.lat, decimals, "N", "S")} ${degrees(probed.lon, decimals, "E", "W")}`;
  const figures = Object.entries(told(probed, frame.mirrored)).map(([name, value]) => `${name}\u00a0${value}`);
  return `${place}: ${probed.rough ? "~ " : ""}${figures.join(", ")}`;
}

const degrees = (value, decimals, positive, negative) =>
  `${Math.abs(value).toFixed(decimals)}° ${value < 0 ? negative : positive}`;
