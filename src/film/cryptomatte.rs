//! Ids of Cryptomatte: names as hashes that are sound floats.
//!
//! Source: Friedman & Jones, *Fully Automatic ID Mattes with Support for Motion Blur and Transparency*,
//! SIGGRAPH 2015; Psyop, *Cryptomatte Specification* 1.2.0.

/// The id of a name: its MurmurHash3, with a bit changed where it would be NaN, infinite or denormal as a
/// float.
pub fn cryptomatte_id(name: &str) -> u32 {
    let hash = murmur3(name.as_bytes());
    let exponent = hash >> 23 & 255;
    if exponent == 0 || exponent == 255 { hash ^ 1 << 23 } else { hash }
}

/// What tells the layers of a file apart: the first seven digits of the hash of a layer's name.
pub fn cryptomatte_key(layer: &str) -> String {
    format!("{:08x}", murmur3(layer.as_bytes()))[..7].to_owned()
}

/// MurmurHash3_x86_32 with seed 0. Source: Appleby, *MurmurHash3.cpp*, smhasher (public domain).
fn murmur3(bytes: &[u8]) -> u32 {
    let scramble = |k: u32| k.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let (words, rest) = bytes.as_chunks::<4>();
    let mut h = 0u32;
    for word in words {
        h ^= scramble(u32::from_le_bytes(*word));
        h = h.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    if !rest.is_empty() {
        let mut word = [0; 4];
        word[..rest.len()].copy_from_slice(rest);
        h ^= scramble(u32::from_le_bytes(word));
    }
    h ^= bytes.len() as u32;
    h = (h ^ h >> 16).wrapping_mul(0x85eb_ca6b);
    h = (h ^ h >> 13).wrapping_mul(0xc2b2_ae35);
    h ^ h >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_of_the_specification() {
        // Known values of MurmurHash3_x86_32.
        assert_eq!(murmur3(b""), 0);
        assert_eq!(murmur3(b"test"), 0xba6b_d213);
        assert_eq!(murmur3(b"Hello, world!"), 0xc036_3e43);
        assert_eq!(murmur3(b"The quick brown fox jumps over the lazy dog"), 0x2e4f_f723);
        // The example of the specification's appendix: "bunny" and its sample manifest.
        assert_eq!(format!("{:08x}", cryptomatte_id("bunny")), "13851a76");
        assert_eq!(format!("{:08x}", cryptomatte_id("default")), "42c9679f");
    }

    #[test]
    fn ids_are_sound_floats() {
        for i in 0..200_000 {
            let id = f32::from_bits(cryptomatte_id(&format!("object.{i}")));
            assert!(id.is_normal(), "{i}: {id}");
        }
    }
}
