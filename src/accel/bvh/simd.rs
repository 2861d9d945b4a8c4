//! Eight or sixteen floats at once: what the kernels of the hierarchy are written in. The only file of the
//! hierarchy with `unsafe`: instructions that not every processor has, and a stack that is not cleared for
//! every ray.
//!
//! A value of [`Avx2`] or [`Avx512`] exists only where the processor was found to have these
//! instructions, and a vector of theirs is only made by such a value: so whoever holds one may use them.
#![allow(unsafe_code)]

use std::mem::MaybeUninit;

/// Lanes of floats. The minimum and maximum of a NaN and a number is the second of the two, as x86 has it.
pub(super) trait Floats: Copy {
    /// The same as an array.
    type Array: AsRef<[f32]> + Copy;

    fn to_array(self) -> Self::Array;
    /// A number in every lane, as many as `self` has.
    fn all(self, x: f32) -> Self;
    /// Eight numbers, as often as there are lanes for them.
    fn eights(self, x: &[f32; 8]) -> Self;
    fn add(self, b: Self) -> Self;
    fn sub(self, b: Self) -> Self;
    fn mul(self, b: Self) -> Self;
    fn div(self, b: Self) -> Self;
    /// `self·b + c`, rounded once where the processor can.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `self·b − c`, rounded once where the processor can.
    fn mul_sub(self, b: Self, c: Self) -> Self;
    /// `c − self·b`, rounded once where the processor can.
    fn neg_mul_add(self, b: Self, c: Self) -> Self;
    fn min(self, b: Self) -> Self;
    fn max(self, b: Self) -> Self;
    fn sqrt(self) -> Self;
    /// In which lanes `self ≤ b`, as bits; not in those with NaN.
    fn le(self, b: Self) -> u32;
    /// In which lanes `self < b`, likewise.
    fn lt(self, b: Self) -> u32;
    /// `b` in the lanes whose bits are set, `self` in the others.
    fn choose(self, bits: u32, b: Self) -> Self;
    /// The least of the lanes, none of which may be NaN.
    fn least(self) -> f32;
    /// The greatest, likewise.
    fn greatest(self) -> f32;
}

/// Lanes of sixteen floats.
pub(super) trait Sixteen: Floats<Array = [f32; 16]> {
    /// Lane `a` in the first eight lanes, lane `b` in the others.
    fn halves(self, a: usize, b: usize) -> Self;
}

/// An instruction set.
pub(super) trait Simd: Copy {
    type F8: Floats<Array = [f32; 8]>;
    type F16: Sixteen;

    fn splat8(self, x: f32) -> Self::F8;
    fn load8(self, x: &[f32; 8]) -> Self::F8;
    fn splat16(self, x: f32) -> Self::F16;
    fn load16(self, x: &[f32; 16]) -> Self::F16;
    /// Runs a kernel compiled for this instruction set.
    fn run<K: Kernel>(self, kernel: K) -> K::Output;
}

/// What is compiled once for each instruction set. `run` and all that it calls must be inlined, or else it
/// is compiled for the baseline.
pub(super) trait Kernel {
    type Output;
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// The instruction set that this processor is best served with.
#[derive(Debug, Clone, Copy)]
pub(super) enum Isa {
    Portable(Portable),
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

impl Isa {
    pub(super) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if let Some(avx512) = Avx512::detect() {
                return Self::Avx512(avx512);
            }
            if let Some(avx2) = Avx2::detect() {
                return Self::Avx2(avx2);
            }
        }
        Self::Portable(Portable)
    }

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Portable(_) => "portable",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => "AVX2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => "AVX-512",
        }
    }

    #[inline(always)]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            Self::Portable(isa) => isa.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(isa) => isa.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(isa) => isa.run(kernel),
        }
    }
}

/// What every processor has: loops over arrays, which the compiler turns into what there is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Portable;

/// Lanes of the portable kind.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lanes<const N: usize>([f32; N]);

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    fn zip(self, b: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], b.0[i])))
    }
}

impl<const N: usize> Floats for Lanes<N> {
    type Array = [f32; N];

    #[inline(always)]
    fn to_array(self) -> [f32; N] {
        self.0
    }

    #[inline(always)]
    fn all(self, x: f32) -> Self {
        Self([x; N])
    }

    #[inline(always)]
    fn eights(self, x: &[f32; 8]) -> Self {
        Self(std::array::from_fn(|i| x[i % 8]))
    }

    #[inline(always)]
    fn add(self, b: Self) -> Self {
        self.zip(b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self.zip(b, |a, b| a - b)
    }

    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        self.zip(b, |a, b| a * b)
    }

    #[inline(always)]
    fn div(self, b: Self) -> Self {
        self.zip(b, |a, b| a / b)
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self.mul(b).add(c)
    }

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        self.mul(b).sub(c)
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        c.sub(self.mul(b))
    }

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        self.zip(b, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn max(self, b: Self) -> Self {
        self.zip(b, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        (0..N).fold(0, |bits, i| bits | u32::from(self.0[i] <= b.0[i]) << i)
    }

    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        (0..N).fold(0, |bits, i| bits | u32::from(self.0[i] < b.0[i]) << i)
    }

    #[inline(always)]
    fn choose(self, bits: u32, b: Self) -> Self {
        Self(std::array::from_fn(|i| if bits >> i & 1 == 1 { b.0[i] } else { self.0[i] }))
    }

    #[inline(always)]
    fn least(self) -> f32 {
        self.0.into_iter().fold(f32::INFINITY, |a, b| if a < b { a } else { b })
    }

    #[inline(always)]
    fn greatest(self) -> f32 {
        self.0.into_iter().fold(f32::NEG_INFINITY, |a, b| if a > b { a } else { b })
    }
}

impl Sixteen for Lanes<16> {
    #[inline(always)]
    fn halves(self, a: usize, b: usize) -> Self {
        Self(std::array::from_fn(|i| self.0[if i < 8 { a } else { b }]))
    }
}

impl Simd for Portable {
    type F8 = Lanes<8>;
    type F16 = Lanes<16>;

    #[inline(always)]
    fn splat8(self, x: f32) -> Lanes<8> {
        Lanes([x; 8])
    }

    #[inline(always)]
    fn load8(self, x: &[f32; 8]) -> Lanes<8> {
        Lanes(*x)
    }

    #[inline(always)]
    fn splat16(self, x: f32) -> Lanes<16> {
        Lanes([x; 16])
    }

    #[inline(always)]
    fn load16(self, x: &[f32; 16]) -> Lanes<16> {
        Lanes(*x)
    }

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> K::Output {
        kernel.run(self)
    }
}

/// Two halves as one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair<F>(F, F);

impl<F: Floats<Array = [f32; 8]>> Floats for Pair<F> {
    type Array = [f32; 16];

    #[inline(always)]
    fn to_array(self) -> [f32; 16] {
        let (a, b) = (self.0.to_array(), self.1.to_array());
        std::array::from_fn(|i| if i < 8 { a[i] } else { b[i - 8] })
    }

    #[inline(always)]
    fn all(self, x: f32) -> Self {
        Self(self.0.all(x), self.1.all(x))
    }

    #[inline(always)]
    fn eights(self, x: &[f32; 8]) -> Self {
        Self(self.0.eights(x), self.1.eights(x))
    }

    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self(self.0.add(b.0), self.1.add(b.1))
    }

    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        Self(self.0.sub(b.0), self.1.sub(b.1))
    }

    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        Self(self.0.mul(b.0), self.1.mul(b.1))
    }

    #[inline(always)]
    fn div(self, b: Self) -> Self {
        Self(self.0.div(b.0), self.1.div(b.1))
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self(self.0.mul_add(b.0, c.0), self.1.mul_add(b.1, c.1))
    }

    #[inline(always)]
    fn mul_sub(self, b: Self, c: Self) -> Self {
        Self(self.0.mul_sub(b.0, c.0), self.1.mul_sub(b.1, c.1))
    }

    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Self(self.0.neg_mul_add(b.0, c.0), self.1.neg_mul_add(b.1, c.1))
    }

    #[inline(always)]
    fn min(self, b: Self) -> Self {
        Self(self.0.min(b.0), self.1.min(b.1))
    }

    #[inline(always)]
    fn max(self, b: Self) -> Self {
        Self(self.0.max(b.0), self.1.max(b.1))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }

    #[inline(always)]
    fn le(self, b: Self) -> u32 {
        self.0.le(b.0) | self.1.le(b.1) << 8
    }

    #[inline(always)]
    fn lt(self, b: Self) -> u32 {
        self.0.lt(b.0) | self.1.lt(b.1) << 8
    }

    #[inline(always)]
    fn choose(self, bits: u32, b: Self) -> Self {
        Self(self.0.choose(bits, b.0), self.1.choose(bits >> 8, b.1))
    }

    #[inline(always)]
    fn least(self) -> f32 {
        self.0.min(self.1).least()
    }

    #[inline(always)]
    fn greatest(self) -> f32 {
        self.0.max(self.1).greatest()
    }
}

impl<F: Floats<Array = [f32; 8]>> Sixteen for Pair<F> {
    #[inline(always)]
    fn halves(self, a: usize, b: usize) -> Self {
        let lanes = self.to_array();
        Self(self.0.all(lanes[a % 16]), self.1.all(lanes[b % 16]))
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{Floats, Kernel, Pair, Simd, Sixteen};

    /// AVX2, fused multiply-add and the counting of bits that came with them; a value of it is the proof
    /// that the processor has all of them.
    #[derive(Debug, Clone, Copy)]
    pub(in super::super) struct Avx2(());

    /// AVX-512, of which only packets of sixteen rays make use: nodes and leaves are eight wide. A value of
    /// it is the proof that the processor has F and VL, and what [`Avx2`] asks for.
    #[derive(Debug, Clone, Copy)]
    pub(in super::super) struct Avx512(Avx2);

    impl Avx2 {
        pub(in super::super) fn detect() -> Option<Self> {
            let has_all = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("popcnt")
                && is_x86_feature_detected!("lzcnt");
            has_all.then_some(Self(()))
        }
    }

    impl Avx512 {
        pub(in super::super) fn detect() -> Option<Self> {
            let has_all =
                is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512vl");
            Avx2::detect().filter(|_| has_all).map(Self)
        }
    }

    /// Declares lanes held in a register, and their arithmetic.
    macro_rules! lanes {
        ($name:ident($register:ty) of $n:literal, $proof:literal: $store:ident, $splat:ident, |$eight:ident| $repeat:expr, $add:ident, $sub:ident,
         $mul:ident, $div:ident, $mul_add:ident, $mul_sub:ident, $neg_mul_add:ident, $min:ident, $max:ident,
         $sqrt:ident, |$a:ident, $b:ident| $le:expr, $lt:expr, |$bits:ident| $choose:expr,
         |$lanes:ident| $least:expr, $greatest:expr) => {
            #[doc = concat!("Lanes of ", $proof, ", made by its methods alone.")]
            #[derive(Debug, Clone, Copy)]
            pub(in super::super) struct $name($register);

            impl Floats for $name {
                type Array = [f32; $n];

                #[inline(always)]
                fn to_array(self) -> [f32; $n] {
                    let mut array = [0.0; $n];
                    // SAFETY: `self` proves the instruction set; the array is as long as the register.
                    unsafe { $store(array.as_mut_ptr(), self.0) };
                    array
                }

                #[inline(always)]
                fn all(self, x: f32) -> Self {
                    // SAFETY: `self` proves the instruction set.
                    Self(unsafe { $splat(x) })
                }

                #[inline(always)]
                fn eights(self, $eight: &[f32; 8]) -> Self {
                    // SAFETY: `self` proves the instruction set; eight floats are read, and the load needs no
                    // alignment.
                    Self(unsafe { $repeat })
                }

                lanes!(@binary add $add, sub $sub, mul $mul, div $div, min $min, max $max);
                lanes!(@ternary mul_add $mul_add, mul_sub $mul_sub, neg_mul_add $neg_mul_add);

                #[inline(always)]
                fn sqrt(self) -> Self {
                    // SAFETY: `self` proves the instruction set.
                    Self(unsafe { $sqrt(self.0) })
                }

                #[inline(always)]
                fn le(self, b: Self) -> u32 {
                    let ($a, $b) = (self.0, b.0);
                    // SAFETY: `self` proves the instruction set.
                    unsafe { $le }
                }

                #[inline(always)]
                fn lt(self, b: Self) -> u32 {
                    let ($a, $b) = (self.0, b.0);
                    // SAFETY: `self` proves the instruction set.
                    unsafe { $lt }
                }

                #[inline(always)]
                fn choose(self, $bits: u32, b: Self) -> Self {
                    let ($a, $b) = (self.0, b.0);
                    // SAFETY: `self` proves the instruction set.
                    Self(unsafe { $choose })
                }

                #[inline(always)]
                fn least(self) -> f32 {
                    let $lanes = self.0;
                    // SAFETY: `self` proves the instruction set.
                    unsafe { $least }
                }

                #[inline(always)]
                fn greatest(self) -> f32 {
                    let $lanes = self.0;
                    // SAFETY: `self` proves the instruction set.
                    unsafe { $greatest }
                }
            }
        };
        (@binary $($name:ident $op:ident),*) => {$(
            #[inline(always)]
            fn $name(self, b: Self) -> Self {
                // SAFETY: `self` proves the instruction set.
                Self(unsafe { $op(self.0, b.0) })
            }
        )*};
        (@ternary $($name:ident $op:ident),*) => {$(
            #[inline(always)]
            fn $name(self, b: Self, c: Self) -> Self {
                // SAFETY: `self` proves the instruction set.
                Self(unsafe { $op(self.0, b.0, c.0) })
            }
        )*};
    }

    /// What is left of all lanes by an operation on two at a time.
    macro_rules! across {
        (halves($v:ident): $of_eight:ident, $of_four:ident) => {{
            let high = _mm256_castpd_ps(_mm512_extractf64x4_pd::<1>(_mm512_castps_pd($v)));
            let both = $of_eight(_mm512_castps512_ps256($v), high);
            across!(both: $of_four)
        }};
        ($v:ident: $of_four:ident) => {{
            let four = $of_four(_mm256_castps256_ps128($v), _mm256_extractf128_ps::<1>($v));
            let two = $of_four(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32($of_four(two, _mm_movehdup_ps(two)))
        }};
    }

    /// All bits of the lanes whose bits are set.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn lane_mask(bits: u32) -> __m256 {
        let each = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        let of_lane = _mm256_and_si256(_mm256_set1_epi32(bits as i32), each);
        _mm256_castsi256_ps(_mm256_cmpeq_epi32(of_lane, each))
    }

    lanes!(Avx8(__m256) of 8, "[`Avx2`]": _mm256_storeu_ps, _mm256_set1_ps, |x| _mm256_loadu_ps(x.as_ptr()), _mm256_add_ps, _mm256_sub_ps, _mm256_mul_ps,
        _mm256_div_ps, _mm256_fmadd_ps, _mm256_fmsub_ps, _mm256_fnmadd_ps, _mm256_min_ps, _mm256_max_ps,
        _mm256_sqrt_ps, |a, b| _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32,
        _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) as u32,
        |bits| _mm256_blendv_ps(a, b, lane_mask(bits)),
        |v| across!(v: _mm_min_ps), across!(v: _mm_max_ps));

    lanes!(Avx16(__m512) of 16, "[`Avx512`]": _mm512_storeu_ps, _mm512_set1_ps,
        |x| _mm512_castpd_ps(_mm512_broadcast_f64x4(_mm256_castps_pd(_mm256_loadu_ps(x.as_ptr())))), _mm512_add_ps, _mm512_sub_ps, _mm512_mul_ps,
        _mm512_div_ps, _mm512_fmadd_ps, _mm512_fmsub_ps, _mm512_fnmadd_ps, _mm512_min_ps, _mm512_max_ps,
        _mm512_sqrt_ps, |a, b| u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b)),
        u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b)),
        |bits| _mm512_mask_blend_ps(bits as u16, a, b),
        |v| across!(halves(v): _mm256_min_ps, _mm_min_ps), across!(halves(v): _mm256_max_ps, _mm_max_ps));

    impl Sixteen for Avx16 {
        #[inline(always)]
        fn halves(self, a: usize, b: usize) -> Self {
            // SAFETY: `self` proves the instruction set; of an index the last four bits count.
            Self(unsafe {
                let (a, b) = (_mm256_set1_epi32(a as i32), _mm256_set1_epi32(b as i32));
                let lanes = _mm512_inserti64x4::<1>(_mm512_castsi256_si512(a), b);
                _mm512_permutexvar_ps(lanes, self.0)
            })
        }
    }

    impl Simd for Avx2 {
        type F8 = Avx8;
        type F16 = Pair<Avx8>;

        #[inline(always)]
        fn splat8(self, x: f32) -> Avx8 {
            // SAFETY: `self` proves the instruction set.
            Avx8(unsafe { _mm256_set1_ps(x) })
        }

        #[inline(always)]
        fn load8(self, x: &[f32; 8]) -> Avx8 {
            // SAFETY: `self` proves the instruction set; the array is as long as the register, and the
            // load needs no alignment.
            Avx8(unsafe { _mm256_loadu_ps(x.as_ptr()) })
        }

        #[inline(always)]
        fn splat16(self, x: f32) -> Pair<Avx8> {
            Pair(self.splat8(x), self.splat8(x))
        }

        #[inline(always)]
        fn load16(self, x: &[f32; 16]) -> Pair<Avx8> {
            let x = x.as_ptr();
            // SAFETY: `self` proves the instruction set; the array is as long as two registers, and the
            // loads need no alignment.
            unsafe { Pair(Avx8(_mm256_loadu_ps(x)), Avx8(_mm256_loadu_ps(x.add(8)))) }
        }

        #[inline(always)]
        fn run<K: Kernel>(self, kernel: K) -> K::Output {
            #[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
            fn compiled<K: Kernel>(simd: Avx2, kernel: K) -> K::Output {
                kernel.run(simd)
            }
            // SAFETY: `self` proves the instruction set.
            unsafe { compiled(self, kernel) }
        }
    }

    impl Simd for Avx512 {
        type F8 = Avx8;
        type F16 = Avx16;

        #[inline(always)]
        fn splat8(self, x: f32) -> Avx8 {
            self.0.splat8(x)
        }

        #[inline(always)]
        fn load8(self, x: &[f32; 8]) -> Avx8 {
            self.0.load8(x)
        }

        #[inline(always)]
        fn splat16(self, x: f32) -> Avx16 {
            // SAFETY: `self` proves the instruction set.
            Avx16(unsafe { _mm512_set1_ps(x) })
        }

        #[inline(always)]
        fn load16(self, x: &[f32; 16]) -> Avx16 {
            // SAFETY: `self` proves the instruction set; the array is as long as the register, and the
            // load needs no alignment.
            Avx16(unsafe { _mm512_loadu_ps(x.as_ptr()) })
        }

        #[inline(always)]
        fn run<K: Kernel>(self, kernel: K) -> K::Output {
            #[target_feature(enable = "avx512f,avx512vl,avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
            fn compiled<K: Kernel>(simd: Avx512, kernel: K) -> K::Output {
                kernel.run(simd)
            }
            // SAFETY: `self` proves the instruction set.
            unsafe { compiled(self, kernel) }
        }
    }
}

/// An address that is asked for, not read.
pub(super) type Place = *const i8;

/// Where a value of a slice lies, if it is there.
#[inline(always)]
pub(super) const fn place<T>(values: &[T], index: usize) -> Place {
    values.as_ptr().wrapping_add(index).cast()
}

/// Has the processor bring the `BYTES` from an address on to its first cache, while something else goes on.
#[inline(always)]
pub(super) fn prefetch<const BYTES: usize>(address: Place) {
    #[cfg(target_arch = "x86_64")]
    for line in (0..BYTES).step_by(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let address = address.wrapping_add(line);
        // SAFETY: every x86-64 processor has the instruction, which reads nothing that a program could see and
        // does not fault, whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(address) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}

/// A stack of numbers that costs nothing to make.
pub(super) struct Stack<const N: usize> {
    len: usize,
    // The first `len` are initialised.
    entries: [MaybeUninit<u64>; N],
}

impl<const N: usize> Stack<N> {
    #[inline(always)]
    pub(super) const fn new() -> Self {
        Self { len: 0, entries: [MaybeUninit::uninit(); N] }
    }

    /// # Panics
    /// When it is full.
    #[inline(always)]
    pub(super) fn push(&mut self, entry: u64) {
        self.entries[self.len] = MaybeUninit::new(entry);
        self.len += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<u64> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: the first `len` entries were initialised by `push`, and this was the last of them.
        Some(unsafe { self.entries[self.len].assume_init() })
    }

    #[inline(always)]
    pub(super) const fn len(&self) -> usize {
        self.len
    }

    /// The entries from `start` on.
    #[inline(always)]
    pub(super) fn since(&mut self, start: usize) -> &mut [u64] {
        let entries = &mut self.entries[start..self.len];
        let (first, len) = (entries.as_mut_ptr(), entries.len());
        // SAFETY: the first `len` entries were initialised by `push`; `MaybeUninit<u64>` is laid out as
        // `u64`, and the slice is borrowed from `self`.
        unsafe { std::slice::from_raw_parts_mut(first.cast(), len) }
    }
}
