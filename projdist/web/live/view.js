// A map that fits a canvas of any shape, with shapes on it.

import { MapView } from "./drawing.js";
import { locate, probe } from "./frames.js";

const MARK = "mark";

export class LiveView extends MapView {
  constructor(canvas, frame) {
    super(canvas, frame);
    canvas.style.removeProperty("aspect-ratio");
    canvas.style.removeProperty("max-width");
    this.shapes = [];
  }

  put(frame) {
    this.frame = frame;
  }

  // The frame's view in the middle of the canvas.
  fit() {
    const ratio = this.frame.preview ? 1 : window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    const [west, east, south, north] = this.frame.view;
    this.zoom = Math.min(width / (east - west), height / (north - south));
    const x = (west + east) / 2, y = (south + north) / 2, w = width / this.zoom / 2, h = height / this.zoom / 2;
    this.view = [x - w, x + w, y - h, y + h];
    return [width, height, ratio];
  }

  // What is at a place of the canvas in its own pixels: longitude, latitude, and the four numbers; null off the map.
  probe(px, py) {
    const triangle = this.at(px * this.ratio, py * this.ratio);
    if (triangle < 0) return null;
    const [x, y] = this.steps(px * this.ratio, py * this.ratio);
    return { ...probe(this.frame, triangle, x, y, this.decimals), x, y };
  }

  get decimals() {
    const { v } = this.frame;
    return Math.max(0, Math.min(6, Math.ceil(-Math.log10(Math.abs(v[2] - v[1]) / 100))));
  }

  show(probed) {
    super.show(probed);
    const context = this.canvas.getContext("2d");
    for (const { lines, name } of this.shapes) this.shape(context, lines, name);
  }

  // Lines of longitude and latitude; where they jump they are parted.
  shape(context, lines, name = MARK) {
    const longest = 0.2 * Math.max(this.canvas.width, this.canvas.height), path = new Path2D();
    for (const line of lines) {
      let last = null;
      for (const [lon, lat] of line) {
        const found = locate(this.frame, lon, lat), at = found && this.pixels(found.x, found.y);
        const near = at && last && Math.hypot(at[0] - last[0], at[1] - last[1]) < longest;
        if (at) path[near ? "lineTo" : "moveTo"](...at);
        last = at;
      }
    }
    for (const [colour, width] of [["halo", 4], [name, 2]]) {
      context.strokeStyle = this.colour(colour);
      context.lineWidth = width * this.ratio;
      context.stroke(path);
    }
  }
}
