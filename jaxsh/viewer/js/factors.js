// What multiplies the coefficients of every light: intensity, the degree at which it is cut, and a window.

// One factor for each of the K coefficients. `windows` has the bands' weights of each kind by degree; a
// zonal one is for the harmonics of order 0 alone.
export function factorsOf(windows, { degree, intensity, window }, count) {
  const { bands, zonal } = windows[window];
  const factors = new Float64Array(count);
  for (let l = 0; l <= degree; l++) {
    const weight = intensity * bands[degree][l];
    factors.fill(zonal ? intensity : weight, l * l, (l + 1) ** 2);
    factors[l * (l + 1)] = weight;
  }
  return factors;
}

export const scaledBy = (factors, light) => light.map((channel) => channel.map((x, k) => factors[k] * x));
