//! What fills space: fog around the objects, and the glasses and liquids within them. Transmittances in
//! closed form; no geometry, no lights.

mod fog;
mod interior;

pub use fog::{Fog, FogProfile};
pub use interior::{Interior, MAX_NESTED, beer_lambert};
