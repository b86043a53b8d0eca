// What a light can have beyond its coefficients: each part is a file of its own.
import { glossyPart } from "./glossy_part.js";
import { lampPart, skyPart, windowPart } from "./light_parts.js";

// A part may have
// - `start(scene)`: what it adds to the state of a light, one for each of the two sides;
// - `controls(viewer)`: what it adds to the panel: objects with an `element` and `show(state)`, which
//   is called whenever the state has changed;
// - `light(coefficients, state, scene)`: other coefficients, three arrays, of those that shade;
// - `shade(renderer, coefficients, state, side, scene)`: shades instead of `Renderer.shade`, and
//   returns true where it did;
// - `python(state, scene)`: lines of Python that say the same of the light;
// - `seesCamera(scene)`: whether the camera changes its shading;
// - `turn(rotation, state, scene)`: what of the state a rotation of the light changes instead of
//   `rotation`, the rotation of its coefficients; nothing where it does not.
export const PARTS = [skyPart, lampPart, glossyPart, windowPart];
