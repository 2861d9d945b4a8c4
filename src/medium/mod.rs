//! What fills space: fog around the objects, the glasses and liquids within them, and grids of data that
//! glow and absorb. Transmittances in closed form where there is one; no surfaces, no lights.

mod fog;
mod interior;
pub mod volume;

pub use fog::{Fog, FogProfile};
pub use interior::{Interior, MAX_NESTED, beer_lambert};
