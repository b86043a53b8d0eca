// The present view, as Python that draws the same.
import { make } from "./controls.js";
import { tangentOf } from "./vectors.js";

// As a float of Python has it.
export const number = (x) => String(Number(x.toPrecision(9))).replace(/^-?\d+$/, "$&.0");
export const row = (values) => values.map(number).join(", ");

// A camera whose picture is that of a window of `width` by `height` pixels, the exposure, and how the
// light was turned.
export function pythonText(state, exposure, width, height) {
  const { camera, rotation } = state;
  const fov = (360 / Math.PI) * Math.atan(tangentOf(camera, width / height));
  const lines = [
    "camera = imaging.Camera(",
    `    position=(${row(camera.position)}),`,
    `    target=(${row(camera.target)}),`,
    `    up=(${row(camera.up)}),`,
    `    fov_y=${number(fov)},`,
    `    width=${width},`,
    `    height=${height},`,
    ")",
    `exposure = ${number(exposure)}`,
  ];
  const turned = rotation.some((values, i) => values.some((x, j) => x !== Number(i === j)));
  if (turned) {
    lines.push(`rotation = [${rotation.map((values) => `[${row(values)}]`).join(", ")}]`);
    lines.push("# light = harmonics.rotate(light, jnp.array(rotation))");
  }
  return lines.join("\n") + "\n";
}

// Puts text where the browser pastes from; false where it does not let us.
export async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const field = make("textarea", { value: text });
    field.style.cssText = "position: fixed; opacity: 0";
    document.body.append(field);
    field.select();
    const done = document.execCommand("copy");
    field.remove();
    return done;
  }
}
