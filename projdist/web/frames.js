// Frames: maps as projdist/web/frames.py encodes them, and the Jacobian anywhere on them.

const TYPES = {
  float64: Float64Array, float32: Float32Array, uint32: Uint32Array, uint16: Uint16Array, uint8: Uint8Array,
};

export async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

// The header of a block, with its arrays by their names.
export function readBlock(buffer) {
  const length = new Uint32Array(buffer, 0, 1)[0];
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const block = { ...header };
  for (const [name, [type, offset, shape]] of Object.entries(header.arrays)) {
    const count = shape.reduce((one, other) => one * other, 1);
    block[name] = new TYPES[type](buffer, 4 + length + offset, count);
  }
  return block;
}

// The frame of a block: with its triangles.
export function readFrame(block) {
  const frame = block;
  frame.rows = frame.shape[0];
  frame.columns = frame.shape[1];
  frame.nodes = frame.rows * frame.columns;
  frame.count = frame.nodes + frame.imageU.length;
  addTriangles(frame);
  return frame;
}

const bit = (bits, index) => (bits[index >> 3] >> (7 - (index & 7))) & 1;

// Triangles as three vertices each; `cells` has the node of a whole cell, or -1 for a part of a torn one.
function addTriangles(frame) {
  const { columns, nodes, whole, cut, cutSizes } = frame;
  let count = 0;
  for (let node = 0; node < nodes; node++) count += 2 * bit(whole, node);
  frame.firstCut = count;
  for (const size of cutSizes) count += Math.max(0, size - 2);
  frame.triangles = new Uint32Array(3 * count);
  frame.cells = new Int32Array(count);
  let next = 0;
  const add = (cell, i, j, k) => {
    frame.cells[next] = cell;
    frame.triangles[3 * next] = i;
    frame.triangles[3 * next + 1] = j;
    frame.triangles[3 * next + 2] = k;
    next++;
  };
  for (let node = 0; node < nodes; node++) {
    if (!bit(whole, node)) continue;
    const right = node % columns === columns - 1 ? node + 1 - columns : node + 1;
    add(node, node, right, right + columns);
    add(node, node, right + columns, node + columns);
  }
  let start = 0;
  for (const size of cutSizes) {
    for (let k = 1; k < size - 1; k++) add(-1, cut[start], cut[start + k], cut[start + k + 1]);
    start += size;
  }
}

const vertexU = (frame, k) => (k < frame.nodes ? frame.u[k % frame.columns] : frame.imageU[k - frame.nodes]);
const vertexV = (frame, k) => (k < frame.nodes ? frame.v[Math.floor(k / frame.columns)] : frame.imageV[k - frame.nodes]);

const turned = (degrees) => degrees - 360 * Math.round(degrees / 360);
const RADIAN = Math.PI / 180;
const WITHIN = 0.01; // the least share of a corner

export function geographic(frame, u, v) {
  if (!frame.axes) return [u, v];
  const m = frame.axes, c = Math.cos(v * RADIAN);
  const p = [c * Math.cos(u * RADIAN), c * Math.sin(u * RADIAN), Math.sin(v * RADIAN)];
  const [x, y, z] = [0, 3, 6].map((row) => m[row] * p[0] + m[row + 1] * p[1] + m[row + 2] * p[2]);
  return [Math.atan2(y, x) / RADIAN, Math.atan2(z, Math.hypot(x, y)) / RADIAN];
}

function gridded(frame, lon, lat) {
  if (!frame.axes) return [lon, lat];
  const m = frame.axes, c = Math.cos(lat * RADIAN);
  const p = [c * Math.cos(lon * RADIAN), c * Math.sin(lon * RADIAN), Math.sin(lat * RADIAN)];
  const [x, y, z] = [0, 1, 2].map((column) => m[column] * p[0] + m[column + 3] * p[1] + m[column + 6] * p[2]);
  return [Math.atan2(y, x) / RADIAN, Math.atan2(z, Math.hypot(x, y)) / RADIAN];
}

// The shares of a triangle's corners at a place in steps of the frame, or within it beside one that is just outside:
// beyond its edge may be a cut.
function shares(frame, triangle, x, y) {
  const [i, j, k] = frame.triangles.subarray(3 * triangle, 3 * triangle + 3);
  const [ax, ay] = [frame.x[i], frame.y[i]];
  const [bx, by, cx, cy] = [frame.x[j] - ax, frame.y[j] - ay, frame.x[k] - ax, frame.y[k] - ay];
  const whole = bx * cy - by * cx || 1;
  const second = ((x - ax) * cy - (y - ay) * cx) / whole, third = (bx * (y - ay) - by * (x - ax)) / whole;
  const inside = [1 - second - third, second, third].map((share) => Math.max(share, WITHIN));
  const sum = inside[0] + inside[1] + inside[2];
  return [[i, inside[0] / sum], [j, inside[1] / sum], [k, inside[2] / sum]];
}

// What is known at a place of a triangle. In whole cells it is that of the place as it is told, with `decimals`.
export function probe(frame, triangle, x, y, decimals) {
  const corners = shares(frame, triangle, x, y);
  const first = vertexU(frame, corners[0][0]);
  let u = first, v = 0;
  for (const [vertex, share] of corners) {
    u += share * turned(vertexU(frame, vertex) - first);
    v += share * vertexV(frame, vertex);
  }
  const place = geographic(frame, u, v);
  const round = (value) => Number(value.toFixed(decimals));
  const [lon, lat] = [round(turned(place[0])), round(Math.max(-90, Math.min(90, place[1])))];
  const cell = frame.cells[triangle];
  if (cell < 0) return { lon, lat, ...between(frame, corners, errorOf(frame.cutError[triangle - frame.firstCut])) };
  const [gridU, gridV] = gridded(frame, lon, lat);
  return { lon, lat, ...inCell(frame, cell, u + turned(gridU - u), gridV) };
}

// Errors are kept as tenths of their decimal exponent; 0 is 1 and more, where nothing is known.
const errorOf = (byte) => (byte > 0 ? 10 ** (-byte / 10) : Infinity);

// Beside a cut: between the corners.
function between(frame, corners, error) {
  const count = frame.count, values = [0, 0, 0, 0];
  const base = corners[0][0];
  for (const [vertex, share] of corners) {
    for (let k = 0; k < 4; k++) {
      let step = frame.fields[k * count + vertex] - frame.fields[k * count + base];
      if (k === 1) step -= 2 * Math.PI * Math.round(step / (2 * Math.PI));
      values[k] += share * step;
    }
  }
  return { values: values.map((value, k) => value + frame.fields[k * count + base]), error, rough: true };
}

function inCell(frame, cell, u, v) {
  const { columns, rows, count } = frame;
  const row = Math.floor(cell / columns), column = cell % columns;
  const cubic = bit(frame.cubic, cell);
  const steps = cubic ? [-1, 0, 1, 2] : [0, 1];
  const across = steps.map((step) => {
    const k = column + step, turns = Math.floor(k / columns);
    return [k - turns * columns, frame.u[k - turns * columns] + 360 * turns];
  });
  const up = steps.map((step) => Math.min(row + step, rows - 1)).map((k) => [k, frame.v[k]]);
  // The cell of the grid may be a turn away from where the place was found.
  const left = across[cubic ? 1 : 0][1];
  const weightsU = weights(across.map(([, value]) => value), left + turned(u - left));
  const weightsV = weights(up.map(([, value]) => value), v);
  const values = [0, 0, 0, 0], base = frame.fields[count + cell];
  up.forEach(([j], m) => across.forEach(([i], n) => {
    const node = j * columns + i, weight = weightsU[n] * weightsV[m];
    for (let k = 0; k < 4; k++) {
      let value = frame.fields[k * count + node];
      if (k === 1) value -= 2 * Math.PI * Math.round((value - base) / (2 * Math.PI));
      values[k] += weight * value;
    }
  }));
  const error = errorOf(frame.error[cell]);
  return { values, error, rough: error > 0.1 };
}

// Lagrange's weights of nodes.
function weights(nodes, place) {
  return nodes.map((node, k) => nodes.reduce(
    (product, other, m) => (m === k ? product : (product * (place - other)) / (node - other)), 1,
  ));
}

// The place of a longitude and latitude, in steps of the frame, and what is known there; null if no whole cell has it.
export function locate(frame, lon, lat) {
  const [gridU, gridV] = gridded(frame, lon, lat);
  const { columns, rows, u, v } = frame;
  const first = u[0] + ((((gridU - u[0]) % 360) + 360) % 360);
  const column = u.findLastIndex((value) => value <= first), row = v.findLastIndex((value) => value <= gridV);
  if (row < 0 || row > rows - 2 || (!frame.wraps && column > columns - 2)) return null;
  const node = row * columns + column;
  if (!bit(frame.whole, node)) return null;
  const right = column === columns - 1 ? node + 1 - columns : node + 1;
  const end = column === columns - 1 ? u[0] + 360 : u[column + 1];
  const s = (first - u[column]) / (end - u[column]), t = (gridV - v[row]) / (v[row + 1] - v[row]);
  const mix = (z) => (1 - t) * ((1 - s) * z[node] + s * z[right]) + t * ((1 - s) * z[node + columns] + s * z[right + columns]);
  return { lon, lat, x: mix(frame.x), y: mix(frame.y), ...inCell(frame, node, first, gridV) };
}
