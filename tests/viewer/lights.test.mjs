// The viewer's lights against numbers that Python wrote: see test_lights.py.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const { folder, header, skyTable, skies, suns, lamp, terms, points, field, cut } = JSON.parse(
  readFileSync(process.env.VIEWER_NUMBERS, "utf8"),
);
const load = (name) => import(pathToFileURL(`${folder}/${name}.js`));
const { basisWithGradient } = await load("harmonics");
const { minutesOf, skyLight, sunAt, keptUp } = await load("sky");
const { ballTerms, gridPoints, interpolated, keptNear, lampTerms } = await load("near");
const { factorsOf } = await load("factors");

const near = (found, expected, tolerance) => {
  assert.equal(found.length, expected.length);
  found.forEach((x, i) => assert.ok(Math.abs(x - expected[i]) <= tolerance, `${x}, ${expected[i]}`));
};

test("the sky is preetham_harmonics and its sun sun_harmonics", () => {
  for (const { sun, turbidity, disc, expected } of skies) {
    const found = skyLight(header.sky, skyTable, sun, turbidity, disc, header.degree);
    const largest = Math.max(...expected.flat().map(Math.abs));
    found.forEach((channel, c) => near([...channel], expected[c], 1e-12 * largest));
  }
  const night = skyLight(header.sky, skyTable, [1, 0, -0.01], 3, true, header.degree);
  assert.ok(night.every((channel) => channel.every((x) => x === 0)));
});

test("the sun stands where sky.sun_direction says", () => {
  for (const { time, latitude, longitude, expected } of suns) {
    near(sunAt(time, latitude, longitude), expected, 1.8e-4); // 0.01°
  }
  near(keptUp([3, 4, -1]), [0.6, 0.8, 0], 1e-15);
  near(keptUp([0, 0, -1]), [1, 0, 0], 0);
});

test("minutes of a day count from midnight, before 1970 too", () => {
  for (const text of ["2026-06-21T10:30:59Z", "1950-06-21T10:30:00Z", "1950-06-21T00:00:00Z"]) {
    const [hours, minutes] = text.slice(11, 16).split(":").map(Number);
    assert.equal(minutesOf(Date.parse(text)), 60 * hours + minutes);
  }
});

test("the basis' gradient is that of finite differences", () => {
  const [vector, step] = [[0.3, -1.1, 0.7], 1e-5];
  const { values, gradient } = basisWithGradient(vector, 10);
  for (let axis = 0; axis < 3; axis++) {
    const at = (sign) => basisWithGradient(
      vector.map((x, i) => x + (i === axis ? sign * step : 0)), 10).values;
    const [high, low] = [at(1), at(-1)];
    near([...values].map((_, k) => gradient[3 * k + axis]),
      [...values].map((_, k) => (high[k] - low[k]) / (2 * step)), 2e-8);
  }
});

test("a ball's terms are sphere_harmonics_with_gradient", () => {
  const { grid, radius } = header.near;
  const count = (header.degree + 1) ** 2;
  near(gridPoints(grid).flat(), points.flat(), 1e-14);
  const sent = lampTerms(header.near, undefined, lamp, header.degree);
  near([...sent.terms], terms, 2e-13);
  near([...ballTerms(points[5], lamp, radius, header.degree)].slice(0, 4 * count),
    terms.slice(20 * count, 24 * count), 2e-13);
});

test("between the samples it is interpolate by the half rule, moved with its lamp", () => {
  const sent = { channels: 3, terms: field.terms, moved: field.moved, color: [1, 1, 1] };
  field.places.forEach((place, i) => {
    interpolated(sent, field.grid, place).forEach((channel, c) =>
      near([...channel], field.expected[i][c], 1e-13));
  });
});

test("a lamp stays beside the samples", () => {
  const { grid, radius, gap } = header.near;
  const middle = grid.lower.map((x, axis) => (x + grid.upper[axis]) / 2);
  for (const place of [middle, points[0], points[21], [middle[0], middle[1], grid.upper[2] + 0.01]]) {
    const kept = keptNear(header.near, place);
    const outside = kept.map((x, axis) => Math.max(grid.lower[axis] - x, x - grid.upper[axis], 0));
    assert.ok(Math.hypot(...outside) >= 0.998 * gap);
    points.forEach((point) =>
      assert.ok(Math.hypot(...point.map((x, i) => x - kept[i])) > radius));
  }
  near(keptNear(header.near, lamp), lamp, 0);
});

test("factors are those of harmonics.window at the degree of the cut", () => {
  for (const { window, degree, expected } of cut) {
    const found = factorsOf(header.windows, { degree, window, intensity: 2 }, 49);
    near([...found], expected.map((x) => 2 * x).concat(Array(49 - expected.length).fill(0)), 1e-15);
  }
});
