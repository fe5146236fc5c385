// In place of decoders for GeoTIFFs that this service never writes.
export class ZSTDDecoder {
  init(): Promise<void> {
    return Promise.reject(new Error("Zstandard is decoded by fzstd here."));
  }
}
export function decode(): never {
  throw new Error("LERC is not read here.");
}
export default { decode };
