// Transfer that came in clusters of like points (transfer.compress), made into what the renderer takes.

// Codes of all coefficients, four in a place, of each point the mean of its cluster and the weighted sum
// of the cluster's components.
export function expanded(scene) {
  const { clusters, weights, clusterOf, clusterCodes, clusterScales, scales, layers } = scene;
  const { points, components } = clusters;
  const places = 4 * scene.rows * scene.rowLength;
  const transfer = new Int16Array(layers * places);
  const parts = components + 1;
  const count = scales.length;
  const sums = new Float64Array(count);
  for (let point = 0; point < points; point++) {
    sums.fill(0);
    for (let i = 0; i < parts; i++) {
      const part = clusterOf[point] * parts + i;
      const share = clusterScales[part] * (i === 0 ? 1 : weights[(i - 1) * points + point]);
      for (let k = 0; k < count; k++) sums[k] += share * clusterCodes[part * count + k];
    }
    for (let k = 0; k < count; k++) {
      if (scales[k] > 0) transfer[(k >> 2) * places + 4 * point + (k & 3)] = Math.round(sums[k] / scales[k]);
    }
  }
  return transfer;
}
