// The panel beside the picture, in groups that fold.
import { bound, button, choice, group, menu, panelOf, seenIf, slider, toggle, words } from "./controls.js";
import { PARTS } from "./parts.js";

const stops = (x) => `${x < 0 ? "−" : "+"}${Math.abs(x).toFixed(1)} stops`;

// Returns its `element`, and `show(state)`, which moves the controls to where the state is.
export function makePanel(viewer) {
  const { scene } = viewer;
  const lights = lightControls(viewer);
  const picture = [
    bound(slider("Exposure", {
      min: -5, max: 5, step: 0.1, value: 0, said: stops,
      changed: (x) => viewer.set({ exposure: 2 ** x }),
    }), (state) => Math.log2(state.exposure)),
  ];
  const looks = ["Its own", "Luminance, in false color", ...scene.values.map(({ name }) => name)];
  picture.push(
    bound(menu("Colors", looks, (look) => viewer.chooseLook(look)), (state) => state.look),
    seenIf((state) => state.look > 0, bound(slider("False color's opacity", {
      min: 0, max: 1, step: 0.05, value: 1, said: (x) => `${Math.round(100 * x)} %`,
      changed: (over) => viewer.set({ over }),
    }), (state) => state.over)),
  );
  const buttons = [
    bound(toggle("Compare two lights", (compare) => viewer.set({ compare })), (state) => state.compare),
    toggle("Drag turns the light", (on) => (viewer.turns = on)),
    button("Reset", () => viewer.reset()),
    button("Save PNG", () => viewer.save()),
    button("Copy the view as Python", () => viewer.copy()),
  ];
  const sides = seenIf((state) => state.compare,
    bound(choice("Side that is changed", ["A", "B"], (i) => viewer.choose(i)), () => viewer.side));
  const groups = [group("Light", [sides, ...lights]), group("Picture", picture, buttons)];
  const show = (state) => {
    [sides, ...lights, ...picture, ...buttons].forEach((control) => control.show?.(state));
  };
  show(viewer.state);
  return { element: panelOf(scene.title, [...groups, help()]), show };
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

const HELP = [
  ["Drag, arrows", "orbit"],
  ["Shift and these, mirror ball", "turn the light"],
  ["Wheel, pinch, + and −", "come near"],
  ["Right button, two fingers", "move"],
  ["Click, Enter", "transfer of a vertex; Escape closes"],
  ["C, F", "compare; false color"],
  ["S, P, R", "save; copy as Python; reset"],
];

const help = () => group("Mouse, touch and keys", [{ element: words(HELP) }], [], false);
