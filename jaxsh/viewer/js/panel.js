// The panel beside the picture, in groups that fold.
import { button, choice, group, menu, panelOf, slider, toggle } from "./controls.js";
import { PARTS } from "./parts.js";

const stops = (x) => `${x < 0 ? "−" : "+"}${Math.abs(x).toFixed(1)} stops`;

// Returns its `element`, and `show(state)`, which moves the controls to where the state is.
export function makePanel(viewer, hint) {
  const { scene } = viewer;
  const lights = lightControls(viewer);
  const picture = [
    bound(slider("Exposure", {
      min: -5, max: 5, step: 0.1, value: 0, said: stops,
      changed: (x) => viewer.set({ exposure: 2 ** x }),
    }), (state) => Math.log2(state.exposure)),
  ];
  const buttons = [
    bound(toggle("Compare two lights", (compare) => viewer.set({ compare })), (state) => state.compare),
    toggle("Drag turns the light", (on) => (viewer.turns = on)),
    button("Reset", () => viewer.reset()),
    button("Save PNG", () => viewer.save()),
  ];
  const sides = bound(choice("Side that is changed", ["A", "B"], (i) => viewer.choose(i)), () => viewer.side);
  const groups = [group("Light", [sides, ...lights]), group("Picture", picture, buttons)];
  const show = (state) => {
    sides.element.hidden = !state.compare;
    [sides, ...lights, ...picture, ...buttons].forEach((control) => control.show?.(state));
  };
  show(viewer.state);
  return { element: panelOf(scene.title, groups, hint), show };
}

function lightControls(viewer) {
  const { scene } = viewer;
  const controls = [
    bound(slider("Intensity of the light", {
      min: 0, max: 4, step: 0.05, value: 1, said: (x) => `× ${x.toFixed(2)}`,
      changed: (intensity) => viewer.set({ intensity }),
    }), (state) => state.intensity),
    bound(slider("Degree of the light", {
      min: 0, max: scene.degree, step: 1, value: scene.degree, said: String,
      changed: (degree) => viewer.set({ degree }),
    }), (state) => state.degree),
  ];
  if (viewer.lights.length > 1) {
    const chosen = menu("Light", scene.names, (index) => viewer.set({ index }));
    controls.unshift(bound(chosen, (state) => state.index));
  }
  return [...controls, ...PARTS.flatMap((part) => part.controls?.(viewer) ?? [])];
}

const bound = (control, read) => ({ ...control, show: (state) => control.set(read(state)) });
