// Starts the viewer of a page that `export_html` wrote.
import { withPictures } from "./pictures.js";
import { decompressed, unpacked } from "./scene.js";
import { Viewer } from "./viewer.js";

const root = document.getElementById("viewer");
try {
  const header = JSON.parse(document.getElementById("header").textContent);
  const bytes = await decompressed(document.getElementById("arrays").textContent);
  new Viewer(root, await withPictures(unpacked(header, bytes)));
} catch (error) {
  root.textContent = `The picture cannot be shown: ${error.message}`;
}
