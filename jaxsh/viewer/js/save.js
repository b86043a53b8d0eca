// Files that the page gives.
import { make } from "./controls.js";

// Saves RGBA whose colors are times their alpha, as `pictureOf` reads it, as a PNG that is
// transparent around the mesh; `draws` may draw over it.
export function saveImage(pixels, width, height, draws) {
  const picture = make("canvas", { width, height });
  for (let i = 0; i < pixels.length; i += 4) {
    const alpha = pixels[i + 3];
    if (alpha === 0 || alpha === 255) continue;
    for (let c = 0; c < 3; c++) pixels[i + c] = (255 * pixels[i + c]) / alpha;
  }
  const context = picture.getContext("2d");
  context.putImageData(new ImageData(pixels, width, height), 0, 0);
  draws(context);
  make("a", { download: "jaxsh.png", href: picture.toDataURL("image/png") }).click();
}
