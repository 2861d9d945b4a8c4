//! Numerics at the extremes, in full: the tables of docs/numerics.md. With `ALHAZEN_DOCS=1` it writes them
//! there. Not a speed but a count of what goes wrong; it differs a little between instruction sets.
//!
//!     ALHAZEN_DOCS=1 cargo bench --bench extremes
#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints tables")]

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/extremes/mod.rs"]
mod extremes;

fn main() {
    let text = extremes::markdown(&extremes::tables(1_000_000));
    println!("{text}");
    if std::env::var_os("ALHAZEN_DOCS").is_some() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/numerics.md");
        let page = std::fs::read_to_string(&path).expect("the page is there");
        let (head, _) = page.split_once("<!-- TABLES -->").expect("it has a mark");
        let page = format!("{head}<!-- TABLES -->\n\n{}\n", text.trim_end());
        std::fs::write(&path, page).expect("it can be written");
    }
}
