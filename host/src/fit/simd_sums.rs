//! Sums over points with the vectors that this processor has: on x86-64 those of AVX, twice as wide as what every such
//! processor has, where the program finds them. The bits are the same with both.
use giotto_shared::circle::{Part, Portable, Walk, sum_blocks};

/// The sum over the blocks of a walk over the points (`x`, `y`), in order.
pub fn sum<P: Part>(part: &P, walk: Walk, x: &[f64], y: &[f64]) -> P::Sum {
    #[cfg(target_arch = "x86_64")]
    if let Some(avx) = avx::Avx::here() {
        return avx.sum(part, walk, x, y);
    }
    sum_blocks(part, Portable, walk, x, y)
}

#[cfg(target_arch = "x86_64")]
mod avx {
    use giotto_shared::circle::{Four, Lanes, Part, Walk, sum_blocks};
    use pulp::x86::V3;
    use pulp::{NullaryFnOnce, cast, f64x4};
    use std::ops::{Add, Div, Mul, Sub};

    /// Proof that this processor has AVX.
    #[derive(Clone, Copy)]
    pub(super) struct Avx(V3);

    impl Avx {
        pub(super) fn here() -> Option<Self> {
            V3::try_new().map(Self)
        }

        pub(super) fn sum<P: Part>(self, part: &P, walk: Walk, x: &[f64], y: &[f64]) -> P::Sum {
            self.0.vectorize(Sum {
                lanes: self,
                part,
                walk,
                x,
                y,
            })
        }
    }

    struct Sum<'a, P> {
        lanes: Avx,
        part: &'a P,
        walk: Walk,
        x: &'a [f64],
        y: &'a [f64],
    }

    impl<P: Part> NullaryFnOnce for Sum<'_, P> {
        type Output = P::Sum;

        // Or it is made for the least of processors.
        #[inline(always)]
        fn call(self) -> P::Sum {
            sum_blocks(self.part, self.lanes, self.walk, self.x, self.y)
        }
    }

    impl Lanes for Avx {
        type Four = Vector;

        #[inline(always)]
        fn four(self, numbers: [f64; 4]) -> Vector {
            Vector {
                avx: self.0,
                lanes: cast(numbers),
            }
        }
    }

    #[derive(Clone, Copy)]
    pub(super) struct Vector {
        avx: V3,
        lanes: f64x4,
    }

    macro_rules! operator {
        ($name:ident, $method:ident, $instruction:ident) => {
            impl $name for Vector {
                type Output = Self;

                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    Self {
                        lanes: self.avx.$instruction(self.lanes, other.lanes),
                        ..self
                    }
                }
            }
        };
    }
    operator!(Add, add, add_f64x4);
    operator!(Sub, sub, sub_f64x4);
    operator!(Mul, mul, mul_f64x4);
    operator!(Div, div, div_f64x4);

    impl Four for Vector {
        #[inline(always)]
        fn sqrt(self) -> Self {
            Self {
                lanes: self.avx.sqrt_f64x4(self.lanes),
                ..self
            }
        }

        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Self {
                lanes: self.avx.max_f64x4(self.lanes, other.lanes),
                ..self
            }
        }

        #[inline(always)]
        fn to_array(self) -> [f64; 4] {
            cast(self.lanes)
        }
    }
}
