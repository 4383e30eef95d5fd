// Measures of distortion from the four numbers of a frame: ln |p|, arg p, and q / p.

const DEGREE = 180 / Math.PI;

// As Math.hypot, in a tenth of its time.
const norm = (x, y) => Math.sqrt(x * x + y * y);

export const MEASURES = {
  fisher: (f) => norm(Math.log(f.a), Math.log(f.b)),
  kavrayskiy: (f) => MEASURES.fisher(f) / Math.SQRT2,
  airy: (f) => norm(f.a - 1, f.b - 1) / Math.SQRT2,
  jordan: (f) => {
    const c = (f.a + f.b) / 2;
    return Math.sqrt(Math.max(0, (c - 1) ** 2 + c * (c * f.n * f.n - 2 * perimeterExcess(f.n * f.n))));
  },
  jordan_kavrayskiy: (f) => Math.sqrt(Math.log((f.a + f.b) / 2) ** 2 + dilogarithm(f.n * f.n) / 2),
  areal_scale: (f) => f.s,
  log_areal_scale: (f) => Math.log(f.s),
  areal_error_ppm: (f) => 1e6 * Math.abs(f.s - 1),
  angular_distortion: (f) => f.omega,
  log_anisotropy: (f) => 2 * Math.atanh(f.n),
  meridian_parallel_angle: (f) => f.theta,
  tissot_semimajor: (f) => f.a,
  tissot_semiminor: (f) => f.b,
  meridional_scale: (f) => f.h,
  parallel_scale: (f) => f.k,
  scale_error_ppm: (f) => 1e6 * Math.max(Math.abs(f.a - 1), Math.abs(f.b - 1)),
  meridian_convergence: (f) => f.convergence,
};

// The perimeter of an ellipse over pi (a + b), less 1, for x = ((a - b) / (a + b))^2, by Gauss's mean.
function perimeterExcess(x) {
  let high = 1, low = Math.sqrt(Math.max(1 - x, 1e-14)), rest = 1;
  for (let power = 2; high - low > 1e-9 * high; power *= 2) {
    const half = (high - low) / 2;
    [high, low] = [high - half, Math.sqrt(high * low)];
    rest -= power * half * half;
  }
  return rest / high - 1;
}

// Euler's Li2 of 0 to 1, by its series, and from 1/2 by its reflection.
function dilogarithm(x) {
  if (x > 0.5) return Math.PI ** 2 / 6 - (x < 1 ? Math.log(x) * Math.log1p(-x) : 0) - dilogarithm(1 - x);
  let sum = 0;
  for (let k = 40; k > 0; k--) sum = x * (sum + 1 / (k * k));
  return sum;
}

// What the books call by letters, each worked out when it is asked for: measures need a few, at many nodes.
class Factors {
  set(log, turn, re, im) {
    this.size = Math.exp(log);
    this.turn = turn;
    this.re = re;
    this.im = im;
    this.ratio = norm(re, im);
    return this;
  }

  get a() { return this.size * (1 + this.ratio); }
  get b() { return this.size * Math.abs(1 - this.ratio); }
  get s() { return this.size * this.size * Math.abs(1 - this.ratio * this.ratio); }
  get h() { return this.size * norm(1 - this.re, this.im); }
  get k() { return this.size * norm(1 + this.re, this.im); }
  get n() { return Math.min(this.ratio, 1 / this.ratio, 1); }
  get omega() { return 2 * DEGREE * Math.asin(this.n); }
  get theta() { return DEGREE * Math.atan2(Math.abs(1 - this.ratio * this.ratio), Math.abs(2 * this.im)); }

  // The image of north is i p (1 - q / p).
  get convergence() {
    const north = this.turn + Math.atan2(-this.im, 1 - this.re) + Math.PI / 2;
    return DEGREE * Math.atan2((this.mirrored ? 1 : -1) * Math.cos(north), Math.sin(north));
  }
}

export function factorsOf(log, turn, re, im, mirrored) {
  return Object.assign(new Factors(), { mirrored }).set(log, turn, re, im);
}

// A measure at all vertices of a frame.
export function valuesOf(frame, name) {
  const { fields, count } = frame, measure = MEASURES[name], values = new Float32Array(count);
  const factors = Object.assign(new Factors(), { mirrored: frame.mirrored });
  for (let k = 0; k < count; k++) {
    values[k] = measure(factors.set(fields[k], fields[count + k], fields[2 * count + k], fields[3 * count + k]));
  }
  return values;
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

// A number with the decimals that its error allows, at most seven; a span where they are none, or nothing is known.
export function certain(value, error) {
  const decimals = Math.floor(-Math.log10(Math.max(2 * error, 1e-12)));
  if (!(Math.abs(value) > error) && decimals < 0) return "?";
  if (decimals < 0) return `${Math.floor(value - error)} to ${Math.ceil(value + error)}`;
  const text = value.toFixed(Math.min(decimals, 7));
  return Number(text) === 0 ? text.replace("-", "") : text;
}
