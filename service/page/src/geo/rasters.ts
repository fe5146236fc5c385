// Rasters of the service as arrays.
import { decompress } from "fzstd";
import { addDecoder, BaseDecoder, fromArrayBuffer } from "geotiff";
import { ask } from "../api/http";

const ZSTANDARD = 50000;

class Zstandard extends BaseDecoder {
  override decodeBlock(buffer: ArrayBufferLike): ArrayBufferLike {
    return decompress(new Uint8Array(buffer)).buffer;
  }
}
// as plain JavaScript, so that the content policy needs to allow no WebAssembly
addDecoder(ZSTANDARD, () => Promise.resolve(Zstandard));

export interface Raster {
  readonly rows: number;
  readonly cols: number;
  readonly bands: readonly (Float32Array | Uint8Array)[];
}

export async function rasterAt(href: string): Promise<Raster> {
  const answer = await ask(href);
  const tiff = await fromArrayBuffer(await answer.arrayBuffer());
  const image = await tiff.getImage();
  const bands = (await image.readRasters()) as unknown as (Float32Array | Uint8Array)[];
  return { rows: image.getHeight(), cols: image.getWidth(), bands: Array.from(bands) };
}
