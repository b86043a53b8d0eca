// Textures, which come as the bytes of PNG files.

// The scene with its pictures decoded; their codes stay as they are.
export async function withPictures(scene) {
  const pictures = await Promise.all(scene.surface.textures.map(({ array }) => {
    const file = new Blob([scene[array]], { type: "image/png" });
    return createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  }));
  return { ...scene, pictures };
}
