// The sky by day, as in jaxsh.sky: the stored fit of Preetham's model, the sun's disc, and where the sun
// stands at a time and place. Directions are to the east, to the north and upwards.
import { basis } from "./harmonics.js";
import { unit } from "./vectors.js";

const RADIANS = Math.PI / 180; // in a degree

// Coefficients of sky.preetham_harmonics(sun, turbidity, …, table="wide"), and with `disc` those of
// sky.sun_harmonics besides: three arrays of K numbers, kcd/m² times `sky.gain`. `table` is of the sky's
// own degree, above which there is the disc alone. Below the horizon the sun leaves no light.
export function skyLight(sky, table, sun, turbidity, disc, degree) {
  const light = [0, 1, 2].map(() => new Float64Array((degree + 1) ** 2));
  const [x, y, z] = unit(sun);
  if (z < 0) return light;
  const theta = Math.atan2(Math.hypot(x, y), z);
  const series = fitted(sky, table, theta, turbidity);
  // Real and imaginary parts of (x + iy)^m turn from azimuth 0 to the sun's (Habel et al., eq. 4).
  let [real, imaginary] = [1, 0];
  for (let m = 0; m <= sky.degree; m++) {
    for (let l = m; l <= sky.degree; l++) {
      for (let channel = 0; channel < 3; channel++) {
        const value = sky.gain * series[channel][(l * (l + 1)) / 2 + m];
        light[channel][l * (l + 1) + m] = value * real;
        if (m > 0) light[channel][l * (l + 1) - m] = value * imaginary;
      }
    }
    [real, imaginary] = [real * x - imaginary * y, real * y + imaginary * x];
  }
  if (!disc) return light;
  const radiance = discRadiance(sky, theta, z, turbidity);
  basis([x, y, z], degree).forEach((value, k) => {
    const band = sky.disc.bands[Math.floor(Math.sqrt(k))];
    for (let channel = 0; channel < 3; channel++) {
      light[channel][k] += sky.gain * radiance[channel] * band * value;
    }
  });
  return light;
}

// The series' sums for each channel and row (l, m ≥ 0), without the factors cos mφ and sin^m θ.
function fitted(sky, table, theta, turbidity) {
  const [first, second] = sky.terms;
  const [low, high] = sky.range.map(Math.log);
  const heights = chebyshev((8 * theta * theta) / Math.PI ** 2 - 1, first);
  const hazes = chebyshev((2 * Math.log(turbidity) - low - high) / (high - low), second);
  const divisors = prefactors(sky.constants, theta, turbidity);
  const rows = table.length / (3 * first * second);
  const sums = [0, 1, 2].map((quantity) =>
    Array.from({ length: rows }, (_, row) => {
      let [sum, place] = [0, (quantity * rows + row) * first * second];
      for (const height of heights) {
        for (const haze of hazes) sum += table[place++] * height * haze;
      }
      return sum * divisors[quantity];
    }),
  );
  return sky.mix.map((weights) =>
    sums[0].map((_, row) => weights.reduce((sum, w, q) => sum + w * sums[q][row], 0)),
  );
}

function chebyshev(x, count) {
  const values = [1, x];
  while (values.length < count) values.push(2 * x * values.at(-1) - values.at(-2));
  return values.slice(0, count);
}

// What the fit was divided by: see `prefactor` in jaxsh/sky/_preetham_fit.py.
function prefactors({ luminance, x, y, zenithX, zenithY }, theta, turbidity) {
  const overGradation = (zenith, coefficients) => {
    const [a, b, c, d, e] = coefficients.map(([slope, start]) => slope * turbidity + start);
    const around = 1 + c * Math.exp(d * theta) + e * Math.cos(theta) ** 2;
    return zenith / ((1 + a * Math.exp(b)) * around);
  };
  const chromaticity = (matrix) =>
    matrix.reduce((sum, row) => sum * turbidity + row.reduce((part, v) => part * theta + v, 0), 0);
  const chi = (4 / 9 - turbidity / 120) * (Math.PI - 2 * theta);
  const brightness = (4.0453 * turbidity - 4.971) * Math.tan(chi) - 0.2155 * turbidity + 2.4192;
  const ofY = overGradation(brightness, luminance);
  const [ofX, ofLittleY] = [
    overGradation(chromaticity(zenithX), x), overGradation(chromaticity(zenithY), y),
  ];
  return [(ofY * ofX) / ofLittleY, ofY, ofY / ofLittleY];
}

// Radiance of the sun's disc, as by sky.sun_radiance, from its tables by wavelength.
function discRadiance({ disc }, theta, cosine, turbidity) {
  const mass = 1 / (cosine + 0.15 * (93.885 - theta / RADIANS) ** -1.253);
  const beta = 0.04608 * turbidity - 0.04586;
  const passed = disc.rayleigh.map((rayleigh, i) => {
    const water = disc.water[i] * mass;
    return Math.exp(
      -mass * (rayleigh + beta * disc.aerosol[i] + disc.ozone[i])
        - (0.2385 * water) / (1 + 20.07 * water) ** 0.45,
    );
  });
  return disc.colors.map((row) => row.reduce((sum, weight, i) => sum + weight * passed[i], 0));
}

// The direction to the sun at a time, in milliseconds since 1970 UTC, and at a latitude and longitude in
// degrees, north and east positive. Meeus, Astronomical Algorithms, chapter 25, the lower accuracy, as
// NOAA's calculator has it: within 0.01° from 1950 to 2050. No refraction.
export function sunAt(time, latitude, longitude) {
  const [sin, cos] = [Math.sin, Math.cos].map((f) => (degrees) => f(degrees * RADIANS));
  const days = time / 86400000 - 10957.5; // since noon of 2000-01-01
  const t = days / 36525;
  const anomaly = 357.52911 + t * (35999.05029 - 0.0001537 * t);
  const center = sin(anomaly) * (1.914602 - t * (0.004817 + 0.000014 * t))
    + sin(2 * anomaly) * (0.019993 - 0.000101 * t) + sin(3 * anomaly) * 0.000289;
  const node = 125.04 - 1934.136 * t;
  const along = 280.46646 + t * (36000.76983 + 0.0003032 * t) + center - 0.00569
    - 0.00478 * sin(node);
  const tilt = 23.4392911 - t * (0.0130042 + t * (1.64e-7 - 5.04e-7 * t)) + 0.00256 * cos(node);
  const ascension = Math.atan2(cos(tilt) * sin(along), cos(along)) / RADIANS;
  const sine = sin(tilt) * sin(along);
  const cosine = Math.sqrt(1 - sine * sine);
  const sidereal = 280.46061837 + 360.98564736629 * days + 0.000387933 * t * t
    - 0.00478 * sin(node) * cos(tilt);
  const hour = sidereal + longitude - ascension;
  return [
    -cosine * sin(hour),
    cos(latitude) * sine - sin(latitude) * cosine * cos(hour),
    sin(latitude) * sine + cos(latitude) * cosine * cos(hour),
  ];
}

// Minutes since midnight, UTC; before 1970 times are negative.
export const minutesOf = (time) => (((Math.floor(time / 60000) % 1440) + 1440) % 1440);

// Degrees of a sun above the horizon.
export const heightOf = ([x, y, z]) => Math.atan2(z, Math.hypot(x, y)) / RADIANS;

// Its degrees from north over east, as on a compass.
export const bearingOf = ([x, y]) => (Math.atan2(x, y) / RADIANS + 360) % 360;

// The direction of a sun at these.
export function sunFrom(height, bearing) {
  const across = Math.cos(height * RADIANS);
  const [sine, cosine] = [Math.sin(bearing * RADIANS), Math.cos(bearing * RADIANS)];
  return [across * sine, across * cosine, Math.sin(height * RADIANS)];
}

// The direction of a sun that was moved, at the horizon at least.
export function keptUp(sun) {
  const [x, y, z] = unit(sun);
  if (z >= 0) return [x, y, z];
  const across = Math.hypot(x, y);
  return across > 0 ? [x / across, y / across, 0] : [1, 0, 0];
}
