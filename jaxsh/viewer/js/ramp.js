// Colors for numbers: matplotlib's viridis, which people with any color vision can read, at 33 places
// of equal distance.

const TABLE =
  "440154470d6048186a482374472d7b4536814240863f49893b528b375a8d33638d2f6a8e2c728e297a8e26818e"
  + "23898e21908c1f988b1f9f8821a68528ae8031b57b3ebc744cc26c5dc9636ece5882d34c96d83fabdc32c0df24"
  + "d5e21aeae51afde725";

export const RAMP = Array.from({ length: TABLE.length / 6 }, (_, i) =>
  [0, 2, 4].map((c) => parseInt(TABLE.slice(6 * i + c, 6 * i + c + 2), 16) / 255),
);

// The color of a number in [0, 1], three in [0, 1].
export function rampColor(t) {
  const place = Math.max(0, Math.min(1, t)) * (RAMP.length - 1);
  const i = Math.min(RAMP.length - 2, Math.floor(place));
  return RAMP[i].map((x, c) => x + (place - i) * (RAMP[i + 1][c] - x));
}

// The colors of n levels, as far apart as they go.
export const levelColors = (n) =>
  Array.from({ length: n }, (_, i) => rampColor(n > 1 ? i / (n - 1) : 0.5));

export const cssColor = (color) => `rgb(${color.map((x) => Math.round(255 * x)).join(" ")})`;
