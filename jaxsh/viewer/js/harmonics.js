// Turns functions on the sphere, by their coefficients in jaxsh's convention: real, without the
// Condon–Shortley phase, coefficient l (l + 1) + m.

// Coordinates x, y, z of the three harmonics of degree 1, which are proportional to y, z and x.
const AXES = [1, 2, 0];

// The blocks of degree 0 to `degree` of the matrix that turns coefficients by a rotation, which is
// given as three rows: block l is an array of (2l + 1)² numbers, by rows. A recursion in l by
// Ivanic & Ruedenberg 1996, "Rotation matrices for real spherical harmonics", with their
// corrections of 1998: equation 8.1 and tables 1 and 2.
export function rotationBlocks(rotation, degree) {
  const first = AXES.flatMap((i) => AXES.map((j) => rotation[i][j]));
  const one = (m, n) => first[3 * (m + 1) + n + 1];
  const blocks = [[1], first].slice(0, degree + 1);
  for (let l = 2; l <= degree; l++) {
    const before = blocks[l - 1];
    const last = (m, n) => before[(2 * l - 1) * (m + l - 1) + n + l - 1];
    const product = (i, m, n) => {
      if (n === l) return one(i, 1) * last(m, l - 1) - one(i, -1) * last(m, 1 - l);
      if (n === -l) return one(i, 1) * last(m, 1 - l) + one(i, -1) * last(m, l - 1);
      return one(i, 0) * last(m, n);
    };
    const block = [];
    for (let m = -l; m <= l; m++) {
      for (let n = -l; n <= l; n++) block.push(element(l, m, n, product));
    }
    blocks.push(block);
  }
  return blocks;
}

function element(l, m, n, product) {
  const size = Math.abs(m);
  const scale = Math.abs(n) === l ? 2 * l * (2 * l - 1) : (l + n) * (l - n);
  let sum = 0;
  if (size < l) sum += Math.sqrt(((l + m) * (l - m)) / scale) * product(0, m, n);
  const v = Math.sqrt(((l + size - 1) * (l + size)) / scale) / 2;
  if (m === 0) {
    sum -= v * Math.SQRT2 * (product(1, 1, n) + product(-1, -1, n));
  } else if (m === 1) {
    sum += v * Math.SQRT2 * product(1, 0, n);
  } else if (m === -1) {
    sum += v * Math.SQRT2 * product(-1, 0, n);
  } else if (m > 0) {
    sum += v * (product(1, m - 1, n) - product(-1, 1 - m, n));
  } else {
    sum += v * (product(1, m + 1, n) + product(-1, -m - 1, n));
  }
  if (m !== 0 && size < l - 1) {
    const w = Math.sqrt(((l - size - 1) * (l - size)) / scale) / 2;
    const both =
      m > 0
        ? product(1, m + 1, n) + product(-1, -m - 1, n)
        : product(1, m - 1, n) - product(-1, 1 - m, n);
    sum -= w * both;
  }
  return sum;
}

// Coefficients of f(Rᵀω) from those of f, an array of K = (degree + 1)² numbers.
export function turned(coefficients, blocks) {
  const result = new Float64Array(coefficients.length);
  for (let l = 0; l * l < coefficients.length; l++) {
    const [size, start] = [2 * l + 1, l * l];
    for (let i = 0; i < size; i++) {
      let sum = 0;
      for (let j = 0; j < size; j++) sum += blocks[l][size * i + j] * coefficients[start + j];
      result[start + i] = sum;
    }
  }
  return result;
}

// The K = (degree + 1)² harmonics in a direction of unit length. Those of order m are a polynomial in
// z, by the three-term recursion of normalized Legendre functions, times the real or the imaginary
// part of (x + iy)^|m|.
export function basis([x, y, z], degree) {
  const values = new Float64Array((degree + 1) ** 2);
  let [cosine, sine, first] = [1, 0, Math.sqrt(1 / (4 * Math.PI))];
  for (let m = 0; m <= degree; m++) {
    let [before, last] = [0, first];
    for (let l = m; l <= degree; l++) {
      const middle = l * (l + 1);
      values[middle + m] = last * cosine;
      if (m > 0) values[middle - m] = last * sine;
      const size = (n) => Math.sqrt((4 * n * n - 1) / (n * n - m * m));
      const next = size(l + 1) * (z * last - (l > m ? before / size(l) : 0));
      [before, last] = [last, next];
    }
    first *= Math.sqrt(((m === 0 ? 2 : 1) * (2 * m + 3)) / (2 * m + 2));
    [cosine, sine] = [x * cosine - y * sine, x * sine + y * cosine];
  }
  return values;
}

// The same of a vector of any length, and three derivatives of each by the vector's x, y and z: those of
// the polynomials, without what points along the vector, over its length.
export function basisWithGradient(vector, degree) {
  const length = Math.hypot(...vector);
  const [x, y, z] = vector.map((v) => v / length);
  const values = basis([x, y, z], degree);
  const gradient = new Float64Array(3 * values.length);
  let [cosine, sine, before1, before2] = [1, 0, 0, 0]; // of orders m and m - 1
  let first = Math.sqrt(1 / (4 * Math.PI));
  const put = (k, dx, dy, dz) => {
    const along = dx * x + dy * y + dz * z;
    gradient[3 * k] = (dx - along * x) / length;
    gradient[3 * k + 1] = (dy - along * y) / length;
    gradient[3 * k + 2] = (dz - along * z) / length;
  };
  for (let m = 0; m <= degree; m++) {
    let [before, last, slopeBefore, slope] = [0, first, 0, 0];
    for (let l = m; l <= degree; l++) {
      const middle = l * (l + 1);
      put(middle + m, m * last * before1, -m * last * before2, slope * cosine);
      if (m > 0) put(middle - m, m * last * before2, m * last * before1, slope * sine);
      const size = (n) => Math.sqrt((4 * n * n - 1) / (n * n - m * m));
      const [scale, share] = [size(l + 1), l > m ? 1 / size(l) : 0];
      const next = scale * (z * last - share * before);
      const nextSlope = scale * (last + z * slope - share * slopeBefore);
      [before, last, slopeBefore, slope] = [last, next, slope, nextSlope];
    }
    first *= Math.sqrt(((m === 0 ? 2 : 1) * (2 * m + 3)) / (2 * m + 2));
    [before1, before2] = [cosine, sine];
    [cosine, sine] = [x * cosine - y * sine, x * sine + y * cosine];
  }
  return { values, gradient };
}
