// The viewer's own mathematics against numbers that Python wrote: see test_javascript.py.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const { folder, turns, basisAt, cameras, header, bytes, text, ramp, transferOf: one, picked } = JSON.parse(
  readFileSync(process.env.VIEWER_NUMBERS, "utf8"),
);
const load = (name) => import(pathToFileURL(`${folder}/${name}.js`));
const { basis, rotationBlocks, turned } = await load("harmonics");
const { about, axesOf, clipMatrix, dot, minus, multiply, orbited } = await load("vectors");
const { decompressed, unpacked } = await load("scene");

const { rampColor } = await load("ramp");
const { rayAt, transferOf, pointUnder } = await load("picking");
const { shortNumber } = await load("color_bar");
const { pythonText } = await load("python_text");

const near = (found, expected, tolerance) => {
  assert.equal(found.length, expected.length);
  found.forEach((x, i) => assert.ok(Math.abs(x - expected[i]) <= tolerance, `${x}, ${expected[i]}`));
};

test("coefficients turn as by harmonics.rotate", () => {
  for (const { rotation, coefficients, expected } of turns) {
    const degree = Math.sqrt(coefficients.length) - 1;
    near(turned(coefficients, rotationBlocks(rotation, degree)), expected, 1e-13);
  }
});

test("the basis is that of harmonics.evaluate", () => {
  for (const { direction, expected } of basisAt) near([...basis(direction, 10)], expected, 1e-13);
});

test("a rotation about an axis is Rodrigues' and turns counter-clockwise", () => {
  near(multiply(about([0, 0, 2], Math.PI / 2), [[1, 0, 0], [0, 1, 0], [0, 0, 1]]).flat(),
    [0, -1, 0, 1, 0, 0, 0, 0, 1], 1e-15);
  const some = multiply(about([1, 2, 3], 0.3), about([1, 2, 3], 0.4));
  near(some.flat(), about([1, 2, 3], 0.7).flat(), 1e-15);
});

test("points stand where the rays of imaging.Camera go", () => {
  for (const { camera, points, pixels } of cameras) {
    const matrix = clipMatrix(camera, camera.aspect, 0.1, 100);
    points.forEach((point, i) => {
      const [x, y, z, w] = [0, 1, 2, 3].map((row) =>
        [...point, 1].reduce((sum, value, column) => sum + value * matrix[4 * column + row], 0));
      near([x / w, y / w], pixels[i], 1e-12);
      assert.ok(Math.abs(z) < w);
    });
  }
});

test("a narrower or wider picture holds all that the camera's does", () => {
  const { camera } = cameras[0];
  const diagonal = (aspect) => {
    const matrix = clipMatrix(camera, aspect, 0.1, 100);
    const [right, up] = axesOf(camera);
    const along = (axis, row) => dot(axis, [0, 1, 2].map((i) => matrix[4 * i + row]));
    return [along(right, 0), along(up, 1)];
  };
  const [across, over] = diagonal(camera.aspect);
  const [narrowAcross, narrowOver] = diagonal(camera.aspect / 2);
  const [wideAcross, wideOver] = diagonal(camera.aspect * 2);
  near([narrowAcross, narrowOver, wideAcross, wideOver],
    [across, over / 2, across / 2, over], 1e-12);
});

test("an orbit keeps the distance and stops at the poles", () => {
  const camera = { position: [0, -4, 0], target: [0, 0, 1], up: [0, 0, 1] };
  const away = (one) => Math.hypot(...minus(one.position, one.target));
  const left = orbited({ ...camera, target: [0, 0, 0] }, Math.PI / 2, 0);
  near(left.position, [-4, 0, 0], 1e-14);
  const above = orbited({ ...camera, target: [0, 0, 0] }, 0, 0.5);
  near(above.position, [0, -4 * Math.cos(0.5), 4 * Math.sin(0.5)], 1e-14);
  for (const over of [9, -9]) {
    const last = orbited(orbited(camera, 0.3, over), 0, over);
    assert.ok(Math.abs(away(last) - away(camera)) < 1e-12);
    assert.ok(axesOf(last)[1][2] > 0.01);
  }
});

test("arrays come out of the page as they went in", async () => {
  const buffer = await decompressed(text);
  assert.equal(buffer.byteLength, bytes);
  const scene = unpacked(header, buffer);
  assert.equal(scene.positions.length, 3 * header.numVertices);
  near(scene.positions.slice(0, 3), header.first, 0);
  assert.equal(scene.albedoCodes.length, 3 * header.numVertices);
  assert.throws(() => unpacked(header, new ArrayBuffer(bytes + 4)), /expected \d+ bytes/);
});

test("the ramp is matplotlib's viridis, within two levels", () => {
  ramp.forEach((color, i) => near(rampColor(i / 255), color, 2 / 255));
});

test("a vertex's transfer is what Python sent, to 16 bits", async () => {
  const scene = unpacked(header, await decompressed(text));
  const found = transferOf(scene, one.vertex);
  assert.equal(found.length, one.expected.length);
  found.forEach((x, k) => assert.ok(Math.abs(x - one.expected[k]) <= 0.51 * header.scales[k]));
});

test("a click finds the vertex that rays find", async () => {
  const scene = unpacked(header, await decompressed(text));
  for (const { origin, direction, expected } of picked) {
    assert.equal(pointUnder(scene, { origin, direction }), expected);
  }
  assert.ok(new Set(picked.map(({ expected }) => expected)).size > 5);
  const { camera, points, pixels } = cameras[1];
  points.forEach((point, i) => {
    const { direction } = rayAt(camera, pixels[i], camera.aspect);
    const away = minus(point, camera.position);
    const cosine = dot(away, direction) / Math.hypot(...away) / Math.hypot(...direction);
    assert.ok(Math.abs(cosine - 1) < 1e-12);
  });
});

test("numbers and a turned light in words", () => {
  const said = [0, -0.5, 12345.6, 1.23456e-7, 2.5e6].map(shortNumber);
  assert.deepEqual(said, ["0", "−0.5", "12350", "1.23e−7", "2.50e+6"]);
  const [{ camera }] = cameras;
  const text = pythonText({ camera, rotation: about([0, 0, 1], 0.5) }, 0.25, 30, 40);
  assert.match(text, /rotation = \[\[0.877582562, -0.479425539, 0\.0\]/);
  assert.match(text, /exposure = 0.25\n/);
});
