//! Writes the worked example of `interchange/FORMAT.md` into a folder: `cargo run -p tests --example two_squares DIR`.

fn main() {
    let folder = std::env::args().nth(1).unwrap_or_else(|| ".".into());
    tests::two_squares::write(folder.as_ref());
}
