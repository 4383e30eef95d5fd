// Measures of distortion from the four numbers of a frame: ln |p|, arg p, and q / p.

const DEGREE = 180 / Math.PI;

export const MEASURES = {
  fisher: (f) => Math.hypot(Math.log(f.a), Math.log(f.b)),
  areal_scale: (f) => f.s,
  angular_distortion: (f) => f.omega,
  tissot_semimajor: (f) => f.a,
  tissot_semiminor: (f) => f.b,
  meridional_scale: (f) => f.h,
  parallel_scale: (f) => f.k,
  scale_error_ppm: (f) => 1e6 * Math.max(Math.abs(f.a - 1), Math.abs(f.b - 1)),
  meridian_convergence: (f) => f.convergence,
};

export function factorsOf(log, turn, re, im, mirrored) {
  const size = Math.exp(log), ratio = Math.hypot(re, im);
  const less = Math.min(ratio, 1 / ratio);
  // The image of north is i p (1 - q / p).
  const north = turn + Math.atan2(-im, 1 - re) + Math.PI / 2;
  const x = (mirrored ? -1 : 1) * Math.cos(north), y = Math.sin(north);
  return {
    a: size * (1 + ratio),
    b: size * Math.abs(1 - ratio),
    s: size * size * Math.abs(1 - ratio * ratio),
    h: size * Math.hypot(1 - re, im),
    k: size * Math.hypot(1 + re, im),
    omega: 2 * DEGREE * Math.asin(Math.min(less, 1)),
    convergence: DEGREE * Math.atan2(-x, y),
  };
}

// The image of a small circle, as points about the origin; y is up.
export function indicatrix([log, turn, re, im], mirrored, radius, count = 48) {
  const size = radius * Math.exp(log), points = [];
  for (let step = 0; step < count; step++) {
    const angle = (2 * Math.PI * step) / count;
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    const [x, y] = [c + re * c + im * s, s + im * c - re * s];
    const [px, py] = [Math.cos(turn) * x - Math.sin(turn) * y, Math.sin(turn) * x + Math.cos(turn) * y];
    points.push([(mirrored ? -1 : 1) * size * px, size * py]);
  }
  return points;
}

// What is known of a place as texts by their symbols; an error is that of ln of scales, and of q / p.
export function told(probed, mirrored) {
  const f = factorsOf(...probed.values, mirrored), error = probed.error;
  const angle = (2 * DEGREE * error) / Math.max(Math.cos(f.omega / 2 / DEGREE), 0.05);
  const worst = 1e6 * Math.max(Math.abs(f.a - 1), Math.abs(f.b - 1));
  return {
    h: certain(f.h, f.h * error),
    k: certain(f.k, f.k * error),
    a: certain(f.a, f.a * error),
    b: certain(f.b, f.b * error),
    s: certain(f.s, 2 * f.s * error),
    "ω": `${certain(f.omega, angle)}°`,
    Fisher: certain(MEASURES.fisher(f), 2 * error),
    ...(worst < 2e4 ? { ppm: certain(worst, 1e6 * f.a * error) } : {}),
    convergence: `${certain(f.convergence, (2 * DEGREE * f.a * error) / f.h)}°`,
  };
}

// A number with the decimals that its error allows, at most seven.
export function certain(value, error) {
  const decimals = Math.floor(-Math.log10(Math.max(2 * error, 1e-12)));
  if (decimals < 0) return String(Math.round(value * 10 ** decimals) / 10 ** decimals);
  const text = value.toFixed(Math.min(decimals, 7));
  return Number(text) === 0 ? text.replace("-", "") : text;
}
