// Writes the pixels of all layers of a .goo file, one byte each.
use std::{env, fs};

fn main() {
    let names: Vec<String> = env::args().collect();
    let goo = goo::GooFile::deserialize(&fs::read(&names[1]).unwrap()).unwrap();
    let mut pixels = Vec::new();
    for layer in &goo.layers {
        let decoder = goo::LayerDecoder::new(&layer.data);
        assert_eq!(layer.checksum, decoder.checksum());
        for run in decoder {
            pixels.extend(std::iter::repeat(run.value).take(run.length as usize));
        }
    }
    fs::write(&names[2], pixels).unwrap();
}
