// The window, the sky and the lamp as parts of a light: their state, their controls and their coefficients.
import { bound, make, menu, seenIf, slider, toggle } from "./controls.js";
import { factorsOf, scaledBy } from "./factors.js";
import { LampHandle } from "./lamp_handle.js";
import { interpolated, keptNear, lampTerms } from "./near.js";
import { NearShading } from "./near_shading.js";
import { number, row } from "./python_text.js";
import { bearingOf, heightOf, keptUp, minutesOf, skyLight, sunAt, sunFrom } from "./sky.js";
import { SunHandle } from "./sun_handle.js";
import { apply, minus, plus } from "./vectors.js";

const numCoefficients = (scene) => (scene.degree + 1) ** 2;
const kindOf = (scene, state) => scene.kinds[state.index];

const WINDOWS = {
  none: "None",
  hann: "Hann",
  lanczos: "Lanczos",
  "zonal-sinc": "Zonal sinc (horizon)",
  positive: "Positive",
};

// Multiplies the coefficients by a window of the degree at which the light is cut.
export const windowPart = {
  start: () => ({ window: "none" }),
  light: (light, state, scene) =>
    scaledBy(factorsOf(scene.windows, { ...state, intensity: 1 }, numCoefficients(scene)), light),
  controls: (viewer) => {
    const kinds = Object.keys(viewer.scene.windows);
    const names = kinds.map((kind) => WINDOWS[kind] ?? kind);
    const chosen = menu("Window against ringing", names, (i) => viewer.set({ window: kinds[i] }));
    return [bound(chosen, (state) => kinds.indexOf(state.window))];
  },
  // The light of a sky stands above; another is the user's.
  python: (state, scene) => {
    const { window, degree } = state;
    if (window === "none") return [];
    const line = `light = light * harmonics.window("${window}", ${degree})[None]`;
    return [kindOf(scene, state) === "sky" ? line : `# ${line}`];
  },
};

// Coefficients of the sky in place of those that were sent, which are those of its first sun.
export const skyPart = {
  start: ({ sky }) => {
    if (!sky) return {};
    const [latitude, longitude] = sky.place;
    const { sun, turbidity, hasDisc: disc, time } = sky;
    return { sun, turbidity, disc, time, latitude, longitude };
  },
  light: (light, state, scene) => {
    if (kindOf(scene, state) !== "sky") return light;
    const { sun, turbidity, disc } = state;
    const found = skyLight(scene.sky, scene.skyTable, sun, turbidity, disc, scene.degree);
    const cut = factorsOf(scene.windows, { ...state, window: "none" }, numCoefficients(scene));
    return scaledBy(cut, found);
  },
  turn: (turn, state, scene) =>
    kindOf(scene, state) === "sky" ? { sun: keptUp(apply(turn, state.sun)) } : undefined,
  controls: (viewer) => (viewer.scene.sky ? skyControls(viewer) : []),
  python: (state, scene) => {
    if (kindOf(scene, state) !== "sky") return [];
    const { sun, turbidity, disc, degree, intensity } = state;
    if (sun[2] < 0) {
      const count = (degree + 1) ** 2;
      return ["# The sun is below the horizon: no light.", `light = jnp.zeros((3, ${count}))`];
    }
    const own = Math.min(degree, scene.sky.degree);
    const lines = [
      `sun, turbidity, gain = jnp.array([${row(sun)}]), ${number(turbidity)}, `
        + number(intensity * scene.sky.gain),
      `light = gain * sky.preetham_harmonics(sun, turbidity, ${own}, table="wide")`,
    ];
    if (degree > own) {
      lines.push(`light = jnp.pad(light, ((0, 0), (0, ${(degree + 1) ** 2 - (own + 1) ** 2})))`);
    }
    if (disc) lines.push(`light += gain * sky.sun_harmonics(sun, turbidity, ${degree})`);
    return lines;
  },
};

// The lamp's light where the mesh is: in its middle for what shows one light, at each vertex for shading.
export const lampPart = {
  start: ({ near }) => (near ? { lamp: near.lamp } : {}),
  light: (light, state, scene) => {
    if (kindOf(scene, state) !== "lamp") return light;
    const found = interpolated(termsOf(scene, state), scene.near.grid, scene.middle);
    const cut = factorsOf(scene.windows, { ...state, window: "none" }, numCoefficients(scene));
    return scaledBy(cut, found);
  },
  shade: (renderer, light, state, side, scene) => {
    if (kindOf(scene, state) !== "lamp") return false;
    renderer.nearShading ??= new NearShading(renderer);
    const factors = factorsOf(scene.windows, state, numCoefficients(scene));
    renderer.nearShading.shade(termsOf(scene, state), factors, side);
    return true;
  },
  turn: (turn, state, scene) => {
    if (kindOf(scene, state) !== "lamp") return undefined;
    const { middle } = scene;
    const lamp = plus(middle, apply(turn, minus(state.lamp, middle)));
    return { lamp: keptNear(scene.near, lamp) };
  },
  controls: (viewer) => (viewer.scene.near ? [new LampHandle(viewer)] : []),
  python: (state, scene) => {
    if (kindOf(scene, state) !== "lamp") return [];
    const { radius, radiance } = scene.near;
    if (scene.nearTerms) return [`# the lamp is at (${row(state.lamp)})`];
    return [
      "ball = midrange.Sphere(",
      `    jnp.array([${row(state.lamp)}]),`,
      `    jnp.array(${number(radius)}),`,
      `    jnp.array([${row(radiance.map((x) => state.intensity * x))}]),`,
      ")",
    ];
  },
};

// The light at the samples, which the picture and the mirror ball both ask for, is kept for a lamp.
const kept = new WeakMap();

function termsOf(scene, { lamp }) {
  if (!kept.has(lamp)) kept.set(lamp, lampTerms(scene.near, scene.nearTerms, lamp, scene.degree));
  return kept.get(lamp);
}

function skyControls(viewer) {
  const { range } = viewer.scene.sky;
  const placed = (changes) => {
    const { time, latitude, longitude } = { ...viewer.state, ...changes };
    viewer.set({ ...changes, sun: sunAt(time, latitude, longitude) });
  };
  const degrees = (x) => `${x.toFixed(0)}°`;
  const controls = [
    new SunHandle(viewer),
    bound(slider("Sun above the horizon", {
      min: 0, max: 90, step: 1, value: 0, said: degrees,
      changed: (up) => viewer.set({ sun: sunFrom(up, bearingOf(viewer.state.sun)) }),
    }), ({ sun }) => heightOf(sun)),
    bound(slider("Sun's bearing from north", {
      min: 0, max: 360, step: 1, value: 0, said: degrees,
      changed: (around) => viewer.set({ sun: sunFrom(Math.max(0, heightOf(viewer.state.sun)), around) }),
    }), ({ sun }) => bearingOf(sun)),
    bound(slider("Turbidity (haze)", {
      min: range[0], max: range[1], step: 0.1, value: range[0], said: (x) => x.toFixed(1),
      changed: (turbidity) => viewer.set({ turbidity }),
    }), ({ turbidity }) => turbidity),
    inRow(bound(toggle("The sun itself", (disc) => viewer.set({ disc })), ({ disc }) => disc)),
    ...placeControls(placed),
  ];
  const under = (state) => kindOf(viewer.scene, state) === "sky";
  return controls.map((control) => seenIf(under, control));
}

// Date, time and place: the sun stands where they say once one of them is changed.
function placeControls(placed) {
  const two = (x) => String(x).padStart(2, "0");
  let now = 0; // the time that the state has
  const clock = slider("Time (UTC)", {
    min: 0, max: 1439, step: 1, value: 0,
    said: (x) => `${two(Math.floor(x / 60))}:${two(x % 60)}`,
    changed: (x) => placed({ time: now + (x - minutesOf(now)) * 60000 }),
  });
  const field = (label, properties, changed) => {
    const input = make("input", properties);
    input.addEventListener("change", () => input.checkValidity() && input.value && changed(input));
    return { element: make("label", { className: "jaxsh-field" }, label, input), input };
  };
  const date = field("Date", { type: "date", min: "1900-01-01", max: "2100-12-31" }, (input) =>
    placed({ time: input.valueAsNumber + minutesOf(now) * 60000 }));
  const latitude = field("Latitude", { type: "number", min: -90, max: 90, step: "any" }, (input) =>
    placed({ latitude: input.valueAsNumber }));
  const longitude = field("Longitude", { type: "number", min: -360, max: 360, step: "any" }, (input) =>
    placed({ longitude: input.valueAsNumber }));
  const night = make("p", { className: "jaxsh-said" });
  return [
    { element: date.element, show: ({ time }) => {
      now = time;
      date.input.value = new Date(time).toISOString().slice(0, 10);
    } },
    bound(clock, ({ time }) => minutesOf(time)),
    { element: latitude.element, show: (state) => (latitude.input.value = state.latitude) },
    { element: longitude.element, show: (state) => (longitude.input.value = state.longitude) },
    { element: night, show: ({ sun }) => {
      night.textContent = sun[2] < 0
        ? "The sun is below the horizon: dark here, for the model has no twilight." : "";
    } },
  ];
}

// A button in a row of its own.
function inRow(control) {
  return { ...control, element: make("div", { className: "jaxsh-buttons jaxsh-row" }, control.element) };
}
