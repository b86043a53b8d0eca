// A lamp near the mesh: its light at the samples of a grid, with its gradient by the place, and what that
// says about a point between them, as in jaxsh.midrange.
import { basisWithGradient } from "./harmonics.js";
import { dot, minus, plus } from "./vectors.js";

// The light at the grid's samples, (samples, 4, channels, K): coefficients and their three derivatives.
// That of a ball of radiance 1, one channel, is found here for each place of the lamp; that of any other
// lamp was sent, and moves with it.
export function lampTerms(near, sent, lamp, degree) {
  if (sent) return { channels: 3, terms: sent, moved: minus(lamp, near.lamp), color: [1, 1, 1] };
  const count = (degree + 1) ** 2;
  const points = gridPoints(near.grid);
  const terms = new Float64Array(points.length * 4 * count);
  points.forEach((point, i) => terms.set(ballTerms(point, lamp, near.radius, degree), 4 * count * i));
  return { channels: 1, terms, moved: [0, 0, 0], color: near.radiance };
}

// Places of the samples, z fastest.
export function gridPoints({ lower, upper, shape }) {
  const points = [];
  for (let i = 0; i < shape[0]; i++) {
    for (let j = 0; j < shape[1]; j++) {
      for (let k = 0; k < shape[2]; k++) {
        const place = [i, j, k].map((n, axis) => n / (shape[axis] - 1));
        points.push(place.map((share, axis) => lower[axis] * (1 - share) + upper[axis] * share));
      }
    }
  }
  return points;
}

// Coefficients at a point of a ball of radiance 1, and behind them each derivative by the point: see
// midrange.sphere_harmonics_with_gradient.
export function ballTerms(point, center, radius, degree) {
  const away = minus(center, point);
  const squared = dot(away, away);
  const sine = (radius * radius) / squared; // squared
  const z = Math.sqrt(1 - sine);
  const { values, gradient } = basisWithGradient(away, degree);
  const count = values.length;
  const terms = new Float64Array(4 * count);
  // Legendre's polynomials P_l(z) and their slopes, by Bonnet's recursions.
  let [before, last, slopeBefore, slope] = [0, 1, 0, 0];
  for (let l = 0; l <= degree; l++) {
    const band = 2 * Math.PI * sine * (l === 0 ? 1 / (1 + z) : slope / (l * (l + 1)));
    const rise = (2 * Math.PI * last * sine) / (squared * z);
    for (let k = l * l; k < (l + 1) ** 2; k++) {
      terms[k] = band * values[k];
      for (let axis = 0; axis < 3; axis++) {
        const turn = band * gradient[3 * k + axis];
        terms[(axis + 1) * count + k] = rise * away[axis] * values[k] - turn;
      }
    }
    const next = ((2 * l + 1) * z * last - l * before) / (l + 1);
    const nextSlope = (2 * l + 1) * last + slopeBefore;
    [before, last, slopeBefore, slope] = [last, next, slope, nextSlope];
  }
  return terms;
}

// Coefficients at a point, three arrays: trilinear weights of the samples around it, each with half of its
// gradient, which is exact for quadratics. See midrange.interpolate.
export function interpolated({ channels, terms, moved, color }, { lower, upper, shape }, point) {
  const count = terms.length / (4 * channels * shape[0] * shape[1] * shape[2]);
  const spacing = shape.map((n, axis) => (upper[axis] - lower[axis]) / (n - 1));
  const place = minus(point, plus(lower, moved)).map((x, axis) => x / spacing[axis]);
  const cell = place.map((x, axis) => Math.max(0, Math.min(shape[axis] - 2, Math.floor(x))));
  const share = minus(place, cell);
  const light = [0, 1, 2].map(() => new Float64Array(count));
  for (let corner = 0; corner < 8; corner++) {
    const side = [corner >> 2, (corner >> 1) & 1, corner & 1];
    const at = cell.map((n, axis) => n + side[axis]);
    const weight = side.reduce((w, one, axis) => w * (one ? share[axis] : 1 - share[axis]), 1);
    const factors = [weight];
    side.forEach((one, axis) => factors.push(0.5 * weight * (share[axis] - one) * spacing[axis]));
    const sample = (at[0] * shape[1] + at[1]) * shape[2] + at[2];
    factors.forEach((factor, term) => {
      for (let channel = 0; channel < 3; channel++) {
        const start = ((4 * sample + term) * channels + (channels === 1 ? 0 : channel)) * count;
        for (let k = 0; k < count; k++) {
          light[channel][k] += color[channel] * factor * terms[start + k];
        }
      }
    });
  }
  return light;
}

// Where a lamp may be that was moved: a ball beside the samples' box, or at least beside the samples, and
// another lamp where the light that was sent reaches over the mesh.
export function keptNear(near, lamp) {
  const { lower, upper } = near.grid;
  if (near.travel) {
    return lamp.map((x, axis) => {
      const [low, high] = near.travel[axis].map((way) => near.lamp[axis] + way);
      return Math.max(low, Math.min(high, x));
    });
  }
  const points = gridPoints(near.grid);
  const fits = (place) => {
    const outside = place.map((x, axis) => Math.max(lower[axis] - x, x - upper[axis], 0));
    const nearest = Math.min(...points.map((point) => Math.hypot(...minus(point, place))));
    return Math.hypot(...outside) >= 0.999 * near.gap && nearest >= 1.05 * near.radius;
  };
  const middle = lower.map((x, axis) => (x + upper[axis]) / 2);
  const away = minus(lamp, middle);
  for (let factor = 1; factor < 30; factor *= 1.02) {
    const place = plus(middle, away, factor);
    if (fits(place)) return place;
  }
  return near.lamp;
}
