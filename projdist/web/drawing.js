// Maps on canvases: the colours of a measure, lines above them, and indicatrices.

import { indicatrix, valuesOf } from "./measures.js";
import { Sheets } from "./sheets.js";

// Where a value lies on a scale, 0 to 1 between its limits.
export function positioner({ kind, limits: [low, high] }) {
  if (kind !== "ratio") return (value) => (value - low) / (high - low);
  const start = Math.log(low), width = Math.log(high) - start;
  return (value) => (Math.log(value) - start) / width;
}

export function coloursOf(scale) {
  return Uint8Array.from(atob(scale.colours), (letter) => letter.charCodeAt(0));
}

// Its 256 colours as pixels.
function tableOf(scale) {
  const colours = coloursOf(scale);
  return Uint32Array.from({ length: 256 }, (_, k) => (
    (255 << 24) | (colours[3 * k + 2] << 16) | (colours[3 * k + 1] << 8) | colours[3 * k]
  ));
}

const COLOURS = ["sea", "land", "graticule", "coast", "halo", "outline", "mark", "paper"]; // of what stays on a map

// Pixels beyond an edge that are still within, so that no line is left between neighbours that are rounded apart.
const BEYOND = 0.05;

// A canvas of a size; to set that, though it is the same, takes time.
function sized(canvas, width, height) {
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  return canvas;
}

export class MapView {
  constructor(canvas, frame) {
    this.canvas = canvas;
    this.frame = frame;
    this.base = document.createElement("canvas");
    this.layer = document.createElement("canvas");
    this.sheets = new Sheets();
    this.view = frame.view;
    const [west, east, south, north] = this.view;
    canvas.style.aspectRatio = `${east - west} / ${north - south}`;
    canvas.style.maxWidth = `${(80 * (east - west)) / (north - south)}vh`;
  }

  // Pixels of the frame's corner, and of a step from there to the right and up.
  fromSteps() {
    const [west, south, step] = this.frame.grid;
    return [(west - this.view[0]) * this.zoom, (this.view[3] - south) * this.zoom, step * this.zoom];
  }

  // Pixels of a place in steps of the frame.
  pixels(x, y) {
    const [left, top, step] = this.fromSteps();
    return [left + x * step, top - y * step];
  }

  steps(px, py) {
    const [west, south, step] = this.frame.grid;
    return [(px / this.zoom + this.view[0] - west) / step, (this.view[3] - py / this.zoom - south) / step];
  }

  // Width and height in pixels, and how many there are to one of the page's.
  fit() {
    const ratio = window.devicePixelRatio || 1, [west, east, south, north] = this.view;
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    this.zoom = width / (east - west);
    return [width, Math.max(1, Math.round((width * (north - south)) / (east - west))), ratio];
  }

  draw(scale, ellipses, isolines = false) {
    const [width, height, ratio] = this.fit();
    for (const canvas of [this.base, this.layer, this.canvas]) sized(canvas, width, height);
    this.ratio = ratio;
    const style = getComputedStyle(this.canvas);
    this.colour = (name) => style.getPropertyValue(`--${name}`).trim();
    this.sheets.suit(width, height, ratio, this.frame, ...COLOURS.map(this.colour));
    this.field(width, height, scale, isolines);
    const context = this.base.getContext("2d"), { regional, preview } = this.frame;
    context.clearRect(0, 0, width, height);
    context.save();
    this.framed(context);
    if (regional) this.sheet(context, "ground", "source-over");
    context.drawImage(this.layer, 0, 0);
    // Lines of previews end where their cells do.
    this.sheet(context, "lines", preview && !regional ? "source-atop" : "source-over");
    if (ellipses) this.ellipses(context, ellipses.spacing);
    context.restore();
    this.show();
  }

  // What does not change with the colours: previews are seen once, other maps keep it.
  sheet(context, name, how) {
    context.globalCompositeOperation = how;
    if (this.frame.preview) this[name](context);
    else context.drawImage(this.sheets.get(name, (own) => this[name](own)), 0, 0);
    context.globalCompositeOperation = "source-over";
  }

  // What is around a region is drawn in the frame of its picture, which may be less than the canvas.
  framed(context) {
    const [left, right, top, bottom] = this.sides();
    context.beginPath();
    context.rect(left, top, right - left, bottom - top);
    context.clip();
  }

  // Left, right, top and bottom of what may be drawn on, in pixels.
  sides() {
    if (!this.frame.regional) return [0, this.base.width, 0, this.base.height];
    const [west, east, south, north] = this.frame.view, { view, zoom } = this;
    return [(west - view[0]) * zoom, (east - view[0]) * zoom, (view[3] - north) * zoom, (view[3] - south) * zoom];
  }

  // Sea and land about a region.
  ground(context) {
    context.fillStyle = this.colour("sea");
    if (this.frame.sea) context.fill(this.path("sea"), "evenodd");
    else context.fillRect(0, 0, this.base.width, this.base.height);
    context.fillStyle = this.colour("land");
    context.fill(this.path("land"), "evenodd");
  }

  // The region, as what colours are kept by.
  mask(context) {
    context.fill(this.region, "evenodd");
  }

  path(name) {
    const path = new Path2D(), points = this.frame[name], [left, top, step] = this.fromSteps();
    let k = 0;
    for (const size of this.frame[`${name}Sizes`] ?? []) {
      for (const end = k + 2 * size, start = k; k < end; k += 2) {
        const x = left + points[k] * step, y = top - points[k + 1] * step;
        if (k === start) path.moveTo(x, y);
        else path.lineTo(x, y);
      }
    }
    return path;
  }

  lines(context) {
    context.lineJoin = context.lineCap = "round";
    const stroke = (name, colour, width, halo) => {
      const path = this.path(name);
      if (halo) {
        context.strokeStyle = this.colour("halo");
        context.lineWidth = (width + 1.2) * this.ratio;
        context.stroke(path);
      }
      context.strokeStyle = this.colour(colour);
      context.lineWidth = width * this.ratio;
      context.stroke(path);
    };
    stroke("graticule", "graticule", 0.5);
    if (this.frame.coast) stroke("coast", "coast", 0.7, true);
    if (this.frame.borders) stroke("borders", "coast", 0.5, true);
    stroke("border", "coast", 1.2, true);
    // Half of it lies outside, over the steps of pixels.
    context.globalCompositeOperation = "source-over";
    stroke("outline", "outline", 1);
    if (this.frame.marks) {
      stroke("marks", "mark", 1.5, true);
      this.names(context);
    }
  }

  // The names of what is marked, those that have room.
  names(context) {
    const size = 12 * this.ratio, taken = [];
    context.font = `600 ${size}px ${getComputedStyle(this.canvas).fontFamily}`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    for (const [name, stepX, stepY] of this.frame.names) {
      const half = context.measureText(name).width / 2 + 2 * this.ratio, [px, py] = this.pixels(stepX, stepY);
      const x = Math.max(half, Math.min(this.canvas.width - half, px));
      const free = (y) =>
        !taken.some(([left, right, line]) => x - half < right && x + half > left && Math.abs(y - line) < size);
      const y = [0, -1, 1, -2, 2].map((lines) => py + lines * size).find(free);
      if (y === undefined) continue;
      taken.push([x - half, x + half, y]);
      context.strokeStyle = this.colour("paper");
      context.lineWidth = 3 * this.ratio;
      context.strokeText(name, x, y);
      context.fillStyle = this.colour("mark");
      context.fillText(name, x, y);
    }
  }

  // The layer of colours, with their isolines, within the region.
  field(width, height, scale, isolines) {
    this.place(width, height);
    this.value(scale);
    this.paint(tableOf(scale));
    const context = this.layer.getContext("2d");
    context.putImageData(this.image, 0, 0);
    if (isolines) this.isolines(context, scale);
    if (this.region) this.sheet(context, "mask", "destination-in");
  }

  // Where the frame comes to lie in pixels; kept while both are the same.
  place(width, height) {
    const { frame } = this, [left, top, step] = this.fromSteps();
    const same = this.image?.width === width && this.image.height === height;
    if (same && this.placed === frame) return;
    if (!same) {
      this.image = new ImageData(width, height);
      this.pick = new Int32Array(width * height);
    }
    this.placed = frame;
    this.xs = Float32Array.from(frame.x, (x) => left + x * step);
    this.ys = Float32Array.from(frame.y, (y) => top - y * step);
    this.region = frame.regional ? this.path("region") : null;
    this.choose(width, height);
  }

  // Which triangle each pixel is of, -1 where it is of none.
  choose(width, height) {
    const { triangles, fields, count } = this.frame, { pick, xs, ys } = this;
    const undefinedAt = (k) => Number.isNaN(fields[k] + fields[2 * count + k]);
    pick.fill(-1);
    for (let t = 0, corner = 0; corner < triangles.length; t++, corner += 3) {
      const i = triangles[corner], j = triangles[corner + 1], k = triangles[corner + 2];
      const ax = xs[i], ay = ys[i], bx = xs[j] - ax, by = ys[j] - ay, cx = xs[k] - ax, cy = ys[k] - ay;
      const whole = bx * cy - by * cx;
      if (whole === 0 || undefinedAt(i) || undefinedAt(j) || undefinedAt(k)) continue;
      const top = Math.max(0, Math.ceil(ay + Math.min(0, by, cy) - 0.5 - BEYOND));
      const bottom = Math.min(height - 1, Math.floor(ay + Math.max(0, by, cy) - 0.5 + BEYOND));
      const left = Math.max(0, Math.ceil(ax + Math.min(0, bx, cx) - 0.5 - BEYOND));
      const right = Math.min(width - 1, Math.floor(ax + Math.max(0, bx, cx) - 0.5 + BEYOND));
      // The share of a corner that a distance makes is that over the height above the other two.
      const longest = Math.max(Math.abs(bx) + Math.abs(by), Math.abs(cx) + Math.abs(cy)), least = -BEYOND * longest / Math.abs(whole);
      // The shares of the second and the third corner grow evenly along a row.
      const moreOfSecond = cy / whole, moreOfThird = -by / whole;
      for (let row = top; row <= bottom; row++) {
        const x = left + 0.5 - ax, y = row + 0.5 - ay, end = row * width + right;
        let second = (x * cy - y * cx) / whole, third = (bx * y - by * x) / whole;
        for (let pixel = row * width + left; pixel <= end; pixel++, second += moreOfSecond, third += moreOfThird) {
          if (second >= least && third >= least && second + third <= 1 - least) pick[pixel] = t;
        }
      }
    }
  }

  // Values at the vertices, between 0 and 255 of a scale, and how they run over each triangle: the one at the canvas's
  // first pixel, and what is added by one to the right and one down.
  value(scale) {
    const position = positioner(scale), { xs, ys } = this, { triangles } = this.frame;
    const values = (this.values = valuesOf(this.frame, scale.name).map((value) => 255 * position(value)));
    if (this.slopes?.length !== triangles.length) this.slopes = new Float64Array(triangles.length);
    const { slopes } = this;
    for (let t = 0; t < triangles.length; t += 3) {
      const i = triangles[t], j = triangles[t + 1], k = triangles[t + 2];
      const ax = xs[i], ay = ys[i], bx = xs[j] - ax, by = ys[j] - ay, cx = xs[k] - ax, cy = ys[k] - ay;
      const whole = bx * cy - by * cx, first = values[i], toSecond = values[j] - first, toThird = values[k] - first;
      const right = (toSecond * cy - toThird * by) / whole, down = (toThird * bx - toSecond * cx) / whole;
      slopes[t] = first + (0.5 - ax) * right + (0.5 - ay) * down;
      slopes[t + 1] = right;
      slopes[t + 2] = down;
    }
  }

  // The colours of all pixels.
  paint(table) {
    const { image: { width, height, data }, pick, slopes } = this, colours = new Uint32Array(data.buffer);
    for (let row = 0, pixel = 0; row < height; row++) {
      for (let column = 0; column < width; column++, pixel++) {
        const t = 3 * pick[pixel], value = t < 0 ? NaN : slopes[t] + column * slopes[t + 1] + row * slopes[t + 2];
        colours[pixel] = value > 0 ? table[value < 255 ? (value + 0.5) | 0 : 255] : value <= 0 ? table[0] : 0;
      }
    }
  }

  // The lines of the levels of the colour bar, triangle by triangle.
  isolines(context, scale) {
    const { values, xs, ys } = this, { triangles } = this.frame, position = positioner(scale), path = new Path2D();
    const middles = scale.levels.map(() => []);
    const levels = scale.levels.map((level) => 255 * position(level));
    const end = (i, j, level, work) => {
      const share = (level - values[i]) / (values[j] - values[i]);
      const place = [xs[i] + share * (xs[j] - xs[i]), ys[i] + share * (ys[j] - ys[i])];
      path[work](...place);
      return place;
    };
    for (let t = 0; t < triangles.length; t += 3) {
      const i = triangles[t], j = triangles[t + 1], k = triangles[t + 2];
      const first = values[i], second = values[j], third = values[k];
      const low = Math.min(first, second, third), high = Math.max(first, second, third);
      for (const [number, level] of levels.entries()) {
        if (!(low < level && level <= high)) continue;
        // The corner that is alone on its side of the level, and the two others.
        const alone = first < level === second < level ? [k, i, j] : first < level === third < level ? [j, k, i] : [i, j, k];
        middles[number].push(end(alone[0], alone[1], level, "moveTo"));
        end(alone[0], alone[2], level, "lineTo");
      }
    }
    context.strokeStyle = this.colour("isoline");
    context.lineWidth = 0.9 * this.ratio;
    // Round ends of short pieces would make beads of a line.
    [context.lineJoin, context.lineCap] = ["round", "butt"];
    context.stroke(path);
    if (!this.frame.preview) this.levels(context, middles, scale.labels);
  }

  // The values of isolines: each as far as can be from the others and from the sides.
  levels(context, middles, labels) {
    const size = 11 * this.ratio, { width, height } = this.image, taken = [];
    context.font = `${size}px ${getComputedStyle(this.canvas).fontFamily}`;
    [context.textAlign, context.textBaseline] = ["center", "middle"];
    middles.forEach((places, k) => {
      const half = context.measureText(labels[k]).width / 2 + 3 * this.ratio;
      const within = (x, y) => this.region === null || context.isPointInPath(this.region, x, y, "evenodd");
      const inside = ([x, y]) => within(x - half, y) && within(x, y) && within(x + half, y);
      const room = ([x, y]) =>
        Math.min(x - half, width - half - x, y - size, height - size - y, ...taken.map(([a, b]) => Math.hypot(x - a, y - b) - 2 * half));
      const few = places.filter((_, n) => n % Math.ceil(places.length / 60) === 0).filter(inside);
      const best = few.reduce((one, other) => (one === null || room(other) > room(one) ? other : one), null);
      if (best === null || room(best) < 0) return;
      taken.push(best);
      context.strokeStyle = this.colour("paper");
      context.lineWidth = 3 * this.ratio;
      context.strokeText(labels[k], ...best);
      context.fillStyle = "#000";
      context.fillText(labels[k], ...best);
    });
  }

  // The triangle at pixels; -1 outside of the region.
  at(px, py) {
    const [column, row] = [Math.floor(px), Math.floor(py)];
    const { width, height } = this.base;
    if (column < 0 || row < 0 || column >= width || row >= height) return -1;
    if (this.region && !this.base.getContext("2d").isPointInPath(this.region, px, py, "evenodd")) return -1;
    return this.pick[row * width + column];
  }

  // Indicatrices all over the map and about its middle, as far apart on it as they can be told.
  ellipses(context, apart = 46) {
    const frame = this.frame, spacing = apart * this.ratio, radius = 0.36 * spacing;
    const { width, height } = this.base, [left, right, top, bottom] = this.sides(), found = [];
    for (let y = (height / 2) % spacing; y < height; y += spacing) {
      for (let x = (width / 2) % spacing; x < width; x += spacing) {
        const triangle = this.at(x, y);
        if (triangle < 0) continue;
        const vertex = frame.triangles[3 * triangle];
        found.push([x, y, [0, 1, 2, 3].map((k) => frame.fields[k * frame.count + vertex])]);
      }
    }
    const semimajor = (values) => Math.exp(values[0]) * (1 + Math.hypot(values[2], values[3]));
    const sizes = found.map(([, , values]) => semimajor(values)).sort((one, other) => one - other);
    const usual = sizes[Math.floor(0.8 * sizes.length)] || 1;
    for (const [x, y, values] of found) {
      // What reaches over its neighbours is an outline; where nothing else would be seen, or it would be cut off at the
      // side of the picture, it is left out.
      const size = semimajor(values) / usual;
      const reach = size * radius, within = x - reach > left && x + reach < right && y - reach > top && y + reach < bottom;
      if (size < 4 && within) this.ellipse(context, x, y, values, radius / usual, 0.8, size < 1.35);
    }
  }

  ellipse(context, x, y, values, radius, line, full = true) {
    const path = new Path2D();
    for (const [dx, dy] of indicatrix(values, this.frame.mirrored, radius)) path.lineTo(x + dx, y - dy);
    path.closePath();
    context.fillStyle = this.colour("face");
    if (full) context.fill(path);
    context.strokeStyle = this.colour("halo");
    context.lineWidth = (line + 1) * this.ratio;
    context.stroke(path);
    context.strokeStyle = this.colour("edge");
    context.lineWidth = line * this.ratio;
    context.stroke(path);
  }

  // The map, and what is probed on it.
  show(probed) {
    const context = this.canvas.getContext("2d");
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.base, 0, 0);
    if (!probed) return;
    const [x, y] = this.pixels(probed.x, probed.y), r = 22 * this.ratio;
    context.setLineDash([3 * this.ratio, 2 * this.ratio]);
    context.strokeStyle = this.colour("edge");
    context.lineWidth = this.ratio;
    context.beginPath();
    context.arc(x, y, r, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
    this.ellipse(context, x, y, probed.values, r, 1.5);
  }
}

// The colour bar with its ticks.
export function drawScale(canvas, scale) {
  const ratio = window.devicePixelRatio || 1, style = getComputedStyle(canvas);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  sized(canvas, Math.round(width * ratio), Math.round(height * ratio));
  const context = canvas.getContext("2d"), colours = coloursOf(scale), position = positioner(scale);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  const [start, stop, bar] = [22, width - 22, 12];
  const colour = (k) => `rgb(${colours[3 * k]} ${colours[3 * k + 1]} ${colours[3 * k + 2]})`;
  const strip = sized(document.createElement("canvas"), 256, 1);
  strip.getContext("2d").putImageData(new ImageData(new Uint8ClampedArray(tableOf(scale).buffer), 256, 1), 0, 0);
  context.drawImage(strip, start, 2, stop - start, bar);
  const edge = new Path2D();
  edge.rect(start, 2, stop - start, bar);
  const end = (at, tip, k) => {
    const path = new Path2D(`M${at} 2 L${tip} ${2 + bar / 2} L${at} ${2 + bar}`);
    context.fillStyle = colour(k);
    context.fill(path);
    edge.addPath(path);
  };
  if (scale.extend === "min" || scale.extend === "both") end(start, start - 9, 0);
  if (scale.extend === "max" || scale.extend === "both") end(stop, stop + 9, 255);
  context.fillStyle = context.strokeStyle = style.color;
  context.lineWidth = 0.5;
  context.stroke(edge);
  context.font = `11px ${style.fontFamily}`;
  context.textAlign = "center";
  let free = -Infinity;
  scale.levels.forEach((level, k) => {
    const x = start + position(level) * (stop - start), half = context.measureText(scale.labels[k]).width / 2;
    context.fillRect(x - 0.5, 2 + bar, 1, 3);
    if (x - half < free || x - half < 0 || x + half > width) return;
    context.fillText(scale.labels[k], x, bar + 17);
    free = x + half + 5;
  });
}
