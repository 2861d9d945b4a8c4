//! Numbering distinct keys in the order of their first appearance.

use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;

use crate::pages::prefer_large;

/// A set of keys, each with its number.
///
/// A table of u32 beside the list of keys: 12 bytes a key and 6 to 12 for the table, where
/// `std::collections::HashMap` takes some 30 to 40. Hashing is seeded anew in every process, so
/// that no file can be made to collide; the numbers do not depend on it.
pub(super) struct Distinct {
    keys: Vec<[u32; 3]>,
    /// Numbers of keys by hash, linear probing; `FREE` where there is none. A power of two long.
    table: Vec<u32>,
    seeds: [u64; 3],
}

const FREE: u32 = u32::MAX;

impl Distinct {
    /// No keys yet, but room for `capacity`.
    pub fn with_capacity(capacity: usize) -> Self {
        let state = RandomState::new();
        let seeds = [0, 1, 2].map(|k: u8| state.hash_one(k) | 1);
        let slots = (capacity + capacity / 2).next_power_of_two().max(64);
        let mut keys = Vec::with_capacity(capacity);
        prefer_large(&mut keys);
        Self { keys, table: table(slots), seeds }
    }

    /// The number of `key`, a new one if it was not seen before.
    ///
    /// After `u32::MAX - 1` keys, new keys get no number: the result is `None`.
    #[inline]
    pub fn number(&mut self, key: [u32; 3]) -> Option<u32> {
        let mask = self.table.len() - 1;
        let mut slot = self.slot(key);
        loop {
            match self.table[slot] {
                FREE => break,
                i if self.keys[i as usize] == key => return Some(i),
                _ => slot = (slot + 1) & mask,
            }
        }
        let new = u32::try_from(self.keys.len()).ok().filter(|&i| i < FREE - 1)?;
        self.table[slot] = new;
        self.keys.push(key);
        // Two thirds full at most.
        if 3 * self.keys.len() > 2 * self.table.len() {
            self.grow();
        }
        Some(new)
    }

    /// The keys by number.
    pub fn into_keys(self) -> Vec<[u32; 3]> {
        self.keys
    }

    #[inline]
    fn slot(&self, key: [u32; 3]) -> usize {
        // The sum of odd-multiplied words; the high bits, which all bits of the key reach.
        let [a, b, c] = [0, 1, 2].map(|k| u64::from(key[k]).wrapping_mul(self.seeds[k]));
        let h = (a ^ b.rotate_left(21) ^ c.rotate_left(42)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        ((h ^ (h >> 32)) as usize) & (self.table.len() - 1)
    }

    fn grow(&mut self) {
        self.table = table(2 * self.table.len());
        let mask = self.table.len() - 1;
        for (i, &key) in self.keys.iter().enumerate() {
            let mut slot = self.slot(key);
            while self.table[slot] != FREE {
                slot = (slot + 1) & mask;
            }
            self.table[slot] = i as u32;
        }
    }
}

/// An empty table: every look at it goes somewhere else.
fn table(slots: usize) -> Vec<u32> {
    let mut table = Vec::with_capacity(slots);
    prefer_large(&mut table);
    table.resize(slots, FREE);
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// The same numbers as a map of the standard library gives, over keys with many repeats.
    #[test]
    fn numbers_by_first_appearance() {
        let mut ours = Distinct::with_capacity(0);
        let mut theirs = HashMap::new();
        let mut state = 1_u64;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let key = [(state >> 60) as u32, (state >> 50) as u32 & 63, (state >> 40) as u32 & 63];
            let next = theirs.len() as u32;
            assert_eq!(ours.number(key), Some(*theirs.entry(key).or_insert(next)));
        }
        let keys = ours.into_keys();
        assert_eq!(keys.len(), theirs.len());
        assert!(keys.iter().enumerate().all(|(i, key)| theirs[key] == i as u32));
    }
}
