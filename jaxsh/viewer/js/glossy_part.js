// Gloss as a part of a light: its share and its lobe, and shading that sees the camera.
import { bound, menu, seenIf, slider } from "./controls.js";
import { GlossyShading } from "./glossy.js";

// Under a lamp near the mesh the diffuse part alone is shown.
export const glossyPart = {
  start: ({ glossy }) => (glossy ? { gloss: 1, lobe: glossy.first } : {}),
  seesCamera: (scene) => Boolean(scene.glossy),
  shade: (renderer, light, state, side, scene) => {
    if (!scene.glossy || state.gloss === 0) return false;
    renderer.glossyShading ??= new GlossyShading(renderer);
    const { specular, lobes } = scene.glossy;
    const shares = specular.map((share) => state.gloss * share);
    renderer.glossyShading.shade(light, state.camera.position, shares, lobes[state.lobe], side);
    return true;
  },
  controls: (viewer) => {
    const { scene } = viewer;
    if (!scene.glossy) return [];
    const gloss = slider("Gloss", {
      min: 0, max: 2, step: 0.05, value: 1, said: (x) => `× ${x.toFixed(2)}`,
      changed: (x) => viewer.set({ gloss: x }),
    });
    const names = scene.glossy.exponents.map((x) => `${Number(x.toPrecision(4))}`);
    const lobe = menu("Exponent of the glossy lobe", names, (i) => viewer.set({ lobe: i }));
    const controls = [bound(gloss, (state) => state.gloss), bound(lobe, (state) => state.lobe)];
    const shades = (state) => scene.kinds[state.index] !== "lamp";
    return controls.map((control) => seenIf(shades, control));
  },
};
