// The viewer as a widget of a notebook (anywidget): the mesh comes as a message once the page asks
// for it, so that a saved notebook does not hold it.
import { withPictures } from "./pictures.js";
import { unpacked } from "./scene.js";
import { Viewer } from "./viewer.js";

function render({ model, el }) {
  let viewer;
  let [asked, left] = [false, false];
  // An element of our own, since the notebook sets the height of its.
  const root = el.appendChild(document.createElement("div"));
  root.style.height = `${model.get("height")}px`;
  root.textContent = "Waiting for the mesh …";
  const lights = () => viewer?.setLights(model.get("lights"));
  // What Python has moved since the last time: what was dragged here since then stays.
  let known = {};
  const moved = () => {
    if (!viewer) return;
    const all = model.get("moved");
    const fresh = Object.entries(all).filter(([name, x]) => String(x) !== String(known[name]));
    known = all;
    viewer.set(Object.fromEntries(fresh));
  };
  const received = async (message, buffers) => {
    if (message.kind !== "scene" || asked) return;
    asked = true;
    const view = buffers[0];
    // A copy, since its start need not be where numbers may stand.
    const bytes = view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength);
    try {
      const scene = await withPictures(unpacked(message.header, bytes));
      if (left) return;
      viewer = new Viewer(root, scene);
      lights();
      moved();
    } catch (error) {
      root.textContent = `The picture cannot be shown: ${error.message}`;
    }
  };
  model.on("msg:custom", received);
  model.on("change:lights", lights);
  model.on("change:moved", moved);
  model.send({ kind: "ready" });
  return () => {
    model.off("msg:custom", received);
    model.off("change:lights", lights);
    model.off("change:moved", moved);
    left = true;
    viewer?.release();
  };
}

export default { render };
