// Places on a sphere: what shapes are made of while they are drawn and moved.

const RADIAN = Math.PI / 180, KM = 6371.0087714;

export const around = (lon) => lon - 360 * Math.round(lon / 360);

export function distance([lon1, lat1], [lon2, lat2]) {
  const a = Math.sin(((lat2 - lat1) * RADIAN) / 2), b = Math.sin(((lon2 - lon1) * RADIAN) / 2);
  const h = a * a + Math.cos(lat1 * RADIAN) * Math.cos(lat2 * RADIAN) * b * b;
  return 2 * KM * Math.asin(Math.min(1, Math.sqrt(h)));
}

function azimuth([lon1, lat1], [lon2, lat2]) {
  const turn = (lon2 - lon1) * RADIAN, [p, q] = [lat1 * RADIAN, lat2 * RADIAN];
  return Math.atan2(Math.sin(turn) * Math.cos(q), Math.cos(p) * Math.sin(q) - Math.sin(p) * Math.cos(q) * Math.cos(turn));
}

export function destination([lon, lat], direction, km) {
  const far = km / KM, p = lat * RADIAN;
  const s = Math.sin(p) * Math.cos(far) + Math.cos(p) * Math.sin(far) * Math.cos(direction);
  const q = Math.asin(Math.max(-1, Math.min(1, s)));
  const turn = Math.atan2(Math.sin(direction) * Math.sin(far) * Math.cos(p), Math.cos(far) - Math.sin(p) * s);
  return [around(lon + turn / RADIAN), q / RADIAN];
}

export function circle(centre, km, count = 180) {
  return Array.from({ length: count + 1 }, (_, k) => destination(centre, (2 * Math.PI * k) / count, km));
}

export function box([west, south, east, north], count = 60) {
  const width = east >= west ? east - west : east - west + 360, line = [];
  const side = (from, to) => {
    for (let k = 0; k < count; k++) line.push([0, 1].map((i) => from[i] + ((to[i] - from[i]) * k) / count));
  };
  const corners = [[west, south], [west + width, south], [west + width, north], [west, north], [west, south]];
  for (let k = 0; k < 4; k++) side(corners[k], corners[k + 1]);
  line.push(corners[4]);
  return line.map(([lon, lat]) => [around(lon), lat]);
}

// Lines moved so that one place comes to another, at the same distances and directions from it.
export function moved(lines, from, to) {
  return lines.map((line) => line.map((place) => destination(to, azimuth(from, place), distance(from, place))));
}

// The box between two places, by the shorter way around.
export function boxBetween([lon1, lat1], [lon2, lat2]) {
  const step = around(lon2 - lon1), [west, east] = step >= 0 ? [lon1, lon2] : [lon2, lon1];
  return [west, Math.min(lat1, lat2), east, Math.max(lat1, lat2)];
}
