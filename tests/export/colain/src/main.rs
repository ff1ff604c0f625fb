//! What another reader finds in a binary CLI file: for each layer how many loops, and what they enclose.
use colain::{clitype::LongCLI, Point, CLI};

fn main() {
    let path = std::env::args().nth(1).expect("a file");
    let data = std::fs::read(path).expect("a file that can be read");
    let model = CLI::<LongCLI>::new(&data).expect("a CLI file");
    for layer in model.iter() {
        let (mut loops, mut area) = (0, 0.0);
        for ring in layer.iter_loops() {
            let points: Vec<(f64, f64)> = ring.iter().map(|p| (p.x() as f64, p.y() as f64)).collect();
            area += points.windows(2).map(|p| (p[0].0 * p[1].1 - p[1].0 * p[0].1) / 2.0).sum::<f64>();
            loops += 1;
        }
        println!("{loops} {area}");
    }
}
