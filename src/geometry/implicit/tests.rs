//! The solver against dense steps in f64 through functions written in Rust, and what it is made of.

use proptest::prelude::*;

use super::enclosure::Enclosure;
use super::interval::Interval;
use super::number::Number;
use super::*;

/// Twenty times as many where there is time: in `make verify`.
fn cases(count: u32) -> ProptestConfig {
    let factor = if std::env::var_os("ALHAZEN_VERIFY").is_some() { 20 } else { 1 };
    ProptestConfig::with_cases(factor * count)
}

fn implicit(text: &str, half: f64) -> Implicit {
    let expression = Expression::parse(text).unwrap_or_else(|e| panic!("{text}: {e}"));
    let half = DVec3::splat(half);
    Implicit::new(Arc::new(expression), Bounds { min: -half, max: half })
}

/// A surface, as text and as Rust.
struct Surface {
    text: &'static str,
    f: fn(DVec3) -> f64,
    half: f64,
}

fn squares(p: DVec3) -> (f64, f64, f64) {
    (p.x * p.x, p.y * p.y, p.z * p.z)
}

const SURFACES: [Surface; 10] = [
    Surface { text: "x^2 + y^2 + z^2 - 1", f: |p| p.length_squared() - 1.0, half: 1.5 },
    Surface {
        text: "(x^2 + y^2 + z^2 + 1 - 0.3^2)^2 - 4*(x^2 + y^2)",
        f: |p| (p.length_squared() + 1.0 - 0.09).powi(2) - 4.0 * (p.x * p.x + p.y * p.y),
        half: 1.4,
    },
    Surface {
        text: "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)",
        f: |p| p.x.sin() * p.y.cos() + p.y.sin() * p.z.cos() + p.z.sin() * p.x.cos(),
        half: 6.0,
    },
    // Taubin's heart.
    Surface {
        text: "(x^2 + 9/4*y^2 + z^2 - 1)^3 - x^2*z^3 - 9/80*y^2*z^3",
        f: |p| {
            let (x, y, z) = squares(p);
            (x + 2.25 * y + z - 1.0).powi(3) - (x + 0.1125 * y) * z * p.z
        },
        half: 1.5,
    },
    // Barth's sextic.
    Surface {
        text: "4*(2.618033988749895*x^2 - y^2)*(2.618033988749895*y^2 - z^2)*(2.618033988749895*z^2 - x^2) \
               - (1 + 2*1.618033988749895)*(x^2 + y^2 + z^2 - 1)^2",
        f: |p| {
            let ((x, y, z), a) = (squares(p), 2.618_033_988_749_895);
            4.0 * (a * x - y) * (a * y - z) * (a * z - x)
                - 4.236_067_977_499_79 * (x + y + z - 1.0).powi(2)
        },
        half: 1.6,
    },
    // A ball less a bite, and a rod.
    Surface {
        text: "min(max(sqrt(x^2 + y^2 + z^2) - 1, 0.7 - sqrt((x-0.8)^2 + y^2 + z^2)), \
               max(abs(y) - 1.2, (x^2 + z^2)^0.5 - 0.1))",
        f: |p| {
            let bite = 0.7 - (p - DVec3::new(0.8, 0.0, 0.0)).length();
            let rod = (p.y.abs() - 1.2).max(p.x.hypot(p.z) - 0.1);
            (p.length() - 1.0).max(bite).min(rod)
        },
        half: 1.3,
    },
    // A drop that is not a polynomial, and a helicoid with a pole.
    Surface {
        text: "exp(-(x^2 + y^2)) * log(3 + z) - 0.4 - cbrt(x*y)/8",
        f: |p| (-p.x * p.x - p.y * p.y).exp() * (3.0 + p.z).ln() - 0.4 - (p.x * p.y).cbrt() / 8.0,
        half: 2.0,
    },
    Surface { text: "y - x*tan(z)", f: |p| p.y - p.x * p.z.tan(), half: 1.5 },
    Surface {
        text: "pow(x, 4) + y^4 + z^4 - (x^2 + y^2 + z^2) + 0.4",
        f: |p| {
            let (x, y, z) = squares(p);
            x * x + y * y + z * z - (x + y + z) + 0.4
        },
        half: 1.4,
    },
    Surface {
        text: "z - 1/(x^2 + y^2 + 1/8)/8 + atan(x*y)",
        f: |p| p.z - 0.125 / (p.x * p.x + p.y * p.y + 0.125) + (p.x * p.y).atan(),
        half: 1.0,
    },
];

/// The first change of sign in `steps` steps of the part of a ray that is in the box, halved to the end.
/// Steps across which a function without a bound changes sign do not count.
fn oracle(
    f: impl Fn(DVec3) -> f64,
    bounds: Bounds,
    o: DVec3,
    d: DVec3,
    steps: usize,
) -> Option<f64> {
    let (enter, exit) = bounds.clip(o, d)?;
    let enter = enter.max(0.0);
    let start = o + d * enter;
    let at = |t: f64| f(start + d * t);
    let step = (exit - enter) / steps as f64;
    let mut before = at(0.0);
    for i in 1..=steps {
        let after = at(i as f64 * step);
        if before * after <= 0.0 {
            let (mut a, mut b) = ((i - 1) as f64 * step, i as f64 * step);
            for _ in 0..60 {
                let m = 0.5 * (a + b);
                if (at(m) < 0.0) == (before < 0.0) { a = m } else { b = m }
            }
            if at(a).abs() < 1e-3 {
                return Some(enter + 0.5 * (a + b));
            }
        }
        before = after;
    }
    None
}

fn unit(v: [f64; 3]) -> DVec3 {
    DVec3::from(v).normalize_or(DVec3::new(0.6, 0.0, 0.8))
}

/// Compares the solver's first hit with the oracle's; panics where they differ.
fn compare(surface: &Surface, o: DVec3, d: DVec3, steps: usize) {
    let shape = implicit(surface.text, surface.half);
    let hit = shape.intersect(o, d, 0.0, f64::INFINITY).map(|h| h.t);
    let expected = oracle(surface.f, shape.bounds(), o, d, steps);
    let told = || format!("{}: {o} {d}: {hit:?}, not {expected:?}", surface.text);
    // What a distance from afar can tell.
    let grain = (1e-12 * surface.half + 4e-16 * o.length()) / d.length();
    if let Some(expected) = expected {
        let hit = hit.unwrap_or_else(|| panic!("{}", told()));
        assert!(hit <= expected + 1e3 * grain, "{}", told());
        if (hit - expected).abs() <= 1e3 * grain {
            return;
        }
    }
    // The steps found nothing as near: the function must be 0 there, or change its sign.
    if let Some(t) = hit {
        let (enter, _) = shape.bounds().clip(o, d).unwrap();
        let start = o + d * enter;
        let f = |t: f64| (surface.f)(start + d * (t - enter));
        let changes = f(t - 4.0 * grain) * f(t + 4.0 * grain) <= 0.0;
        assert!(changes || f(t).abs() < 1e-13, "{}: {}", told(), f(t));
    }
}

proptest! {
    #![proptest_config(cases(600))]

    #[test]
    fn first_hits_are_those_of_dense_steps(
        which in 0..SURFACES.len(),
        from in prop::array::uniform3(-1f64..1.0),
        aim in prop::array::uniform3(-1f64..1.0),
        log_distance in -3f64..6.0,
        log_length in -3f64..3.0,
    ) {
        let surface = &SURFACES[which];
        let o = unit(from) * surface.half * 10f64.powf(log_distance);
        let d = (DVec3::from(aim) * surface.half - o) * 10f64.powf(log_length);
        compare(surface, o, d / o.length(), 2000);
    }

    /// Rays that pass at about the distance at which they would touch.
    #[test]
    fn grazing_rays(
        which in 0..SURFACES.len(),
        from in prop::array::uniform3(-1f64..1.0),
        aim in prop::array::uniform3(-1f64..1.0),
        turn in 0f64..6.3,
        off in -1e-4f64..1e-4,
    ) {
        let surface = &SURFACES[which];
        let shape = implicit(surface.text, surface.half);
        let o = unit(from) * surface.half * 2.0;
        let d = DVec3::from(aim) * surface.half - o;
        let Some(hit) = shape.intersect(o, d, 0.0, f64::INFINITY) else { return Ok(()) };
        let at = shape.surface_at(o + d * hit.t, 0);
        let (u, v) = at.normal.any_orthonormal_pair();
        let along = u * turn.cos() + v * turn.sin();
        compare(surface, at.position + at.normal * off - along * 3.0 * surface.half, along, 4000);
    }
}

/// Random expressions, as text.
fn expressions() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("x".to_owned()),
        Just("y".to_owned()),
        Just("z".to_owned()),
        (-3f64..3.0).prop_map(|k| format!("({k:.3})")),
    ];
    leaf.prop_recursive(5, 32, 2, |inner| {
        let unary = prop::sample::select(vec![
            "sqrt", "cbrt", "abs", "exp", "log", "sin", "cos", "tan", "atan", "-",
        ]);
        let binary = prop::sample::select(vec!["+", "-", "*", "/"]);
        let named = prop::sample::select(vec!["min", "max"]);
        prop_oneof![
            (unary, inner.clone()).prop_map(|(f, a)| format!("{f}({a})")),
            (inner.clone(), binary, inner.clone()).prop_map(|(a, o, b)| format!("({a}{o}{b})")),
            (named, inner.clone(), inner.clone()).prop_map(|(f, a, b)| format!("{f}({a},{b})")),
            (inner, -4i32..6).prop_map(|(a, n)| format!("({a})^({n})")),
        ]
    })
}

fn interval(e: &Expression, b: Bounds) -> Interval {
    let xyz = std::array::from_fn(|i| Interval::new(b.min[i], b.max[i]));
    e.tape.with_registers(|registers| e.tape.evaluate(xyz, registers))
}

#[test]
fn quotients_of_bounds_without_end_hold_every_value() {
    let x = |lo, hi| Interval::new(lo, hi);
    let inf = f64::INFINITY;
    for (a, b, lo, hi) in [
        (x(-inf, 2.0), x(0.5, inf), -inf, 4.0),
        (x(-inf, 2.0), x(-inf, -0.5), -4.0, inf),
        (x(3.0, inf), x(0.5, inf), 0.0, inf),
        (x(-inf, -3.0), x(0.5, inf), -inf, 0.0),
        (x(-inf, inf), x(0.5, inf), -inf, inf),
        (x(3.0, inf), x(-inf, -0.5), -inf, 0.0),
    ] {
        let quotient = a.div(b);
        assert!(quotient.lo <= lo && hi <= quotient.hi, "{a:?} / {b:?} = {quotient:?}");
        let is_close = |x: f64, y: f64| x == y || (x - y).abs() < 1e-12;
        assert!(is_close(quotient.lo, lo) && is_close(quotient.hi, hi), "{a:?} / {b:?}: wide");
    }
    // Found at random.
    let e = Expression::parse("log(y - cbrt(x)) / x^(-2)").unwrap();
    let center = DVec3::new(-1.8109754528054354, 3.6854910596925308, 0.0);
    let corner = DVec3::splat(7.07);
    let range = interval(&e, Bounds { min: center - corner, max: center + corner });
    let value = e.value(center - DVec3::Y * 4.576);
    assert!(value < -3.0 && range.lo <= value && value <= range.hi, "{value} {range:?}");
}

#[test]
fn nothing_is_divided_by_zero() {
    for text in
        ["x / (y - y)", "x / -(y - y)", "(x - x)^(-1)", "1 / min(0, x)", "x / sqrt(-(y - y))"]
    {
        assert!(Expression::parse(text).unwrap().value(DVec3::ONE).is_nan(), "{text}");
    }
}

proptest! {
    #![proptest_config(cases(4000))]

    /// Every value in a box lies in the interval that is computed for it.
    #[test]
    fn intervals_hold_every_value(
        text in expressions(),
        center in prop::array::uniform3(-4f64..4.0),
        log_half in -12f64..1.0,
        at in prop::array::uniform3(-1f64..=1.0),
    ) {
        let Ok(e) = Expression::parse(&text) else { return Ok(()) };
        let half = 10f64.powf(log_half);
        let corner = DVec3::splat(half);
        let c = DVec3::from(center);
        let bounds = Bounds { min: c - corner, max: c + corner };
        let p = (c + DVec3::from(at) * half).clamp(bounds.min, bounds.max);
        let (value, range) = (e.value(p), interval(&e, bounds));
        prop_assert!(value.is_nan() || (range.lo <= value && value <= range.hi), "{value} {range:?}");
    }

    /// So do the values along a ray in their enclosure, but for what f64 rounds of the value itself.
    #[test]
    fn enclosures_hold_every_value(
        text in expressions(),
        o in prop::array::uniform3(-3f64..3.0),
        d in prop::array::uniform3(-3f64..3.0),
        log_half in -12f64..1.0,
        at in -1f64..=1.0,
    ) {
        let Ok(e) = Expression::parse(&text) else { return Ok(()) };
        let half = 10f64.powf(log_half);
        let enclosure = |t: f64, half: f64| {
            let xyz = std::array::from_fn(|i| Enclosure::along(o[i], d[i], t, half));
            e.tape.with_registers(|registers| e.tape.evaluate(xyz, registers))
        };
        // The point's own enclosure is as wide as its rounding.
        let (whole, point) = (enclosure(1.0, half), enclosure(1.0 + at * half, 0.0));
        let value = e.value(DVec3::from(o) + DVec3::from(d) * (1.0 + at * half));
        if value.is_finite() && point.width < f64::INFINITY {
            let slack = 2.0 * point.width;
            prop_assert!(
                whole.range.lo - slack <= value && value <= whole.range.hi + slack,
                "{value} {whole:?} {point:?}"
            );
            let line = whole.center + whole.slope * at;
            prop_assert!((value - line).abs() <= (whole.width + slack) * (1.0 + 1e-12), "{value} {whole:?} {point:?}");
            prop_assert!((value - point.center).abs() <= slack, "{value} {point:?}");
        }
    }

    /// Gradients are what differences tend to.
    #[test]
    fn gradients_are_slopes(
        text in expressions(),
        p in prop::array::uniform3(-3f64..3.0),
        axis in 0usize..3,
    ) {
        let Ok(e) = Expression::parse(&text) else { return Ok(()) };
        let p = DVec3::from(p);
        let value = |h: f64| e.value(p + DVec3::AXES[axis] * h);
        let slope = |h: f64| (value(h) - value(-h)) / (2.0 * h);
        // Where two step widths agree, f is smooth there.
        let (near, far, farther) = (slope(1e-5), slope(2e-5), slope(4e-5));
        let size = 1.0 + near.abs() + value(0.0).abs();
        let (a, b) = ((near - far).abs(), (far - farther).abs());
        let sides = (value(1e-5) + value(-1e-5) - 2.0 * value(0.0)).abs() / 1e-5;
        let is_smooth = a < 1e-7 * size && b < 1e-7 * size && sides < 1e-3 * size;
        let gradient = e.dual(p).gradient[axis];
        // Differences tell no more than rounding of the value lets them.
        let here = std::array::from_fn(|i| Enclosure::along(p[i], 0.0, 1.0, 0.0));
        let rounding = e.tape.with_registers(|registers| e.tape.evaluate(here, registers)).width;
        let is_precise = rounding < 1e-10 * size;
        if !(is_smooth && is_precise && size < 1e6 && gradient.is_finite()) {
            return Ok(());
        }
        prop_assert!((gradient - near).abs() < 1e-4 * size, "{gradient}, not {near}");
    }
}

#[test]
fn values_are_those_of_arithmetic() {
    let p = DVec3::new(2.0, -3.0, 0.5);
    for (text, value) in [
        ("x + y*z - 1", -0.5),
        ("-x^2", -4.0),
        ("x^y", 0.125),
        ("y^3", -27.0),
        ("y^-2", 1.0 / 9.0),
        ("x^3^2", 512.0),
        ("2^-x", 0.25),
        ("x - y - z", 4.5),
        ("x / y / z", -4.0 / 3.0),
        ("-(-x)", 2.0),
        ("+x--1", 3.0),
        ("min(x, y, z) + max(x, y)", -1.0),
        ("pow(x, 10)", 1024.0),
        ("1.5e1*x + .5E+1 + 2.e-0", 37.0),
        ("cos(pi*x)", 1.0),
        ("x*x*x - x^3 + x", 2.0),
        ("4^z", 2.0),
        ("tan(z) - sin(z)/cos(z) + x", 2.0),
    ] {
        let e = Expression::parse(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        let got = e.value(p);
        assert!((got - value).abs() < 1e-14, "{text}: {got}, not {value}");
    }
    for undefined in ["sqrt(y)", "log(y)", "y^z", "min(x, sqrt(y))", "min(sqrt(y), x)"] {
        assert!(Expression::parse(undefined).unwrap().value(p).is_nan(), "{undefined}");
    }
}

/// Where f64 has −∞ for the logarithm of 0, the interval holds it, and no number that is not below all.
#[test]
fn the_logarithm_of_zero_is_below_every_number() {
    let e = Expression::parse("log(max(0, x)) + 9").unwrap();
    let bounds = Bounds { min: DVec3::NEG_ONE, max: DVec3::splat(-0.5) };
    let range = interval(&e, bounds);
    assert_eq!(e.value(bounds.min), f64::NEG_INFINITY);
    assert!(range.lo == f64::NEG_INFINITY && range.hi < -1e300, "{range:?}");
}

#[test]
fn equal_parts_are_computed_once_and_constants_not_at_all() {
    let length = |text: &str| Expression::parse(text).unwrap().tape.len();
    assert_eq!(length("x"), 1);
    assert_eq!(length("x*1 + (2*3 - 6)"), 1);
    assert_eq!(length("(x + y)^2 + (y + x)^2"), 5, "x, y, sum, square, double");
    assert_eq!(length("x*x*x"), 2, "x, cube");
    assert_eq!(length("sin(x)*2*pi/4"), 5, "x, sine, three scalings");
}

#[test]
fn errors_point_at_the_byte() {
    for (text, at, message) in [
        ("", 0, "expected a number, x, y, z, pi, a function, `-` or `(`, not the end"),
        ("x + ", 4, "expected a number, x, y, z, pi, a function, `-` or `(`, not the end"),
        ("x + * y", 4, "expected a number, x, y, z, pi, a function, `-` or `(`, not `*`"),
        ("2x", 1, "expected an operator (+ - * / ^) or the end, not `x`"),
        ("x)", 1, "no `(` is open that this would close"),
        (
            "(x + y",
            6,
            "expected an operator (+ - * / ^) or `)` for the `(` at character 1, not the end",
        ),
        (
            "x + foo",
            4,
            "unknown name `foo`; accepted: x, y, z, pi and the functions sqrt, cbrt, abs, exp, log, \
             ln, sin, cos, tan, atan, min, max, pow",
        ),
        ("sin x", 4, "expected `(` after `sin`, not `x`"),
        ("x + sin(x, y)", 4, "`sin` takes one argument, not 2"),
        ("min(x)", 0, "`min` takes two arguments or more, not 1"),
        ("x - pow(x, y, z)", 4, "`pow` takes two arguments, not 3"),
        (
            "sin(x; y)",
            5,
            "expected an operator (+ - * / ^), `,` or `)` for the `sin(` at character 1, not `;`",
        ),
        ("x + 1.2.3", 4, "`1.2.3` is no number of at most 1.8e308"),
        ("x + 1e999", 4, "`1e999` is no number of at most 1.8e308"),
        ("x + 1/0", 5, "this is the number inf, which is not finite"),
        ("x + sqrt(-2)", 4, "this is the number NaN, which is not finite"),
        ("1 + 2", 0, "the expression is a constant; it must depend on x, y or z"),
        ("x = 1", 2, "expected an operator (+ - * / ^) or the end, not `=`"),
        ("ü", 0, "unknown name `ü`; accepted"),
        ("x·y", 1, "expected an operator (+ - * / ^) or the end, not `·`"),
    ] {
        let error = Expression::parse(text).expect_err(text);
        assert_eq!(error.at, at, "{text}: {error}");
        assert!(error.message.starts_with(message), "{text}: {}", error.message);
    }
}

/// Nesting and length are limited, whatever they are made of; a long sum is none of them.
#[test]
fn no_text_overflows_the_stack() {
    for piece in ["(", "-", "sin(", "x^", "min(x,", "-(", "2^-("] {
        let error = Expression::parse(&piece.repeat(2000)).expect_err(piece);
        assert_eq!(error.message, "more than 100 parentheses, signs or powers deep");
    }
    let error = Expression::parse(&"x+".repeat(20_000)).unwrap_err();
    assert_eq!(error.message, "the expression is longer than 16384 bytes");
    // Beyond the registers on the stack.
    let long = (1..500).map(|i| format!("sin({i}*x)")).collect::<Vec<_>>().join("+");
    let shape = implicit(&long, 1.0);
    assert!(shape.expression().tape.len() > 1000);
    let hit = shape.intersect(DVec3::new(-0.5, 0.0, 0.0), DVec3::X, 0.0, 1.0).unwrap();
    let p = DVec3::X * (hit.t - 0.5);
    let (before, after) = (p - DVec3::X * 1e-9, p + DVec3::X * 1e-9);
    let e = shape.expression();
    assert!(e.value(p).abs() < 1e-10 || e.value(before) * e.value(after) < 0.0);
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused(text in "[-xyz0-9.+*/^(), a-z]{0,40}|.{0,20}") {
        if let Err(error) = Expression::parse(&text) {
            prop_assert!(error.at <= text.len() && text.is_char_boundary(error.at));
        }
    }
}

/// A shell of 10⁻⁶ is met from outside and from within, square on and nearly grazing.
#[test]
fn thin_features_are_not_skipped() {
    let shape = implicit("(x^2 + y^2 + z^2 - 1)*(x^2 + y^2 + z^2 - (1 - 1e-6)^2)", 3.0);
    let sheet = implicit("(z - 0.1)*(z - 0.1 - 1e-9)", 3.0);
    for i in 0..2000 {
        let angle = f64::from(i) * 2.399;
        let offset = f64::from(i) / 2000.0 * 0.999_999;
        let (o, d) = (DVec3::new(offset, 0.0, -2.9), DVec3::Z);
        let turn = glam::DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), angle);
        let hit = shape.intersect(turn * o, turn * d, 0.0, f64::INFINITY).unwrap().t;
        let expected = 2.9 - (1.0 - offset * offset).sqrt();
        assert!((hit - expected).abs() < 1e-9, "{i}: {hit}, not {expected}");
        let inner = shape.intersect(DVec3::ZERO, turn * d, 0.0, 10.0).unwrap().t;
        assert!((inner - (1.0 - 1e-6)).abs() < 1e-9, "{i}: {inner}");
        let d = DVec3::new(angle.cos(), angle.sin(), 0.05);
        let hit = sheet.intersect(DVec3::ZERO, d, 0.0, 10.0).unwrap().t;
        assert!((hit - 2.0).abs() < 1e-9, "{i}: {hit}");
    }
}

#[test]
fn roots_that_touch_poles_and_rays_in_the_surface() {
    let along = |text: &str, o: [f64; 3], d: [f64; 3]| {
        let shape = implicit(text, 2.0);
        shape.intersect(DVec3::from(o), DVec3::from(d), 0.0, f64::INFINITY).map(|h| h.t)
    };
    // A sphere that f touches everywhere: known as well as the root of the rounding.
    let hit = along("(x^2 + y^2 + z^2 - 1)^2", [-5.0, 0.1, 0.2], [1.0, 0.0, 0.0]).unwrap();
    assert!((hit - (5.0 - 0.95f64.sqrt())).abs() < 1e-7, "{hit}");
    assert!(along("(x^2 + y^2 + z^2 - 1)^2 + 1e-12", [-5.0, 0.1, 0.2], [1.0, 0.0, 0.0]).is_none());
    // A ray that touches a sphere, and rays that pass it.
    assert!(along("x^2 + y^2 + z^2 - 1", [-5.0, 1.0, 0.0], [1.0, 0.0, 0.0]).is_some());
    let past = 1.0 + 1e-12;
    assert!(along("x^2 + y^2 + z^2 - 1", [-5.0, past, 0.0], [1.0, 0.0, 0.0]).is_none());
    // 1/x changes sign without being 0, and an odd root touches steeply.
    assert_eq!(along("1/x", [-5.0, 0.3, 0.0], [1.0, 0.0, 0.0]), None);
    assert_eq!(along("tan(x)/(x^2 + 1/x) - 1e9", [-5.0, 0.3, 0.0], [0.0, 1.0, 0.0]), None);
    let root = along("cbrt(x - 1)", [-5.0, 0.3, 0.0], [1.0, 0.0, 0.0]).unwrap();
    assert!((root - 6.0).abs() < 1e-11, "{root}");
    // In the surface: where the ray enters the box.
    assert!(along("z", [-5.0, 0.3, 0.0], [1.0, 0.0, 0.0]).unwrap() < 3.0 + 1e-4);
    // Nowhere defined along the ray.
    assert_eq!(along("sqrt(-1 - x^2) * y", [-5.0, 0.3, 0.0], [1.0, 0.0, 0.0]), None);
}

#[test]
fn hits_lie_beyond_t_min_and_up_to_t_max() {
    let ball = implicit("x^2 + y^2 + z^2 - 1", 1.0);
    let hit =
        |t_min, t_max| ball.intersect(DVec3::NEG_X * 3.0, DVec3::X, t_min, t_max).map(|h| h.t);
    let near = |t: Option<f64>, expected: f64| (t.unwrap() - expected).abs() < 1e-11;
    assert!(near(hit(0.0, 10.0), 2.0) && near(hit(2.5, 10.0), 4.0));
    assert_eq!((hit(0.0, 1.9), hit(2.5, 3.5), hit(4.5, 9.0)), (None, None, None));
    assert!(near(hit(f64::NEG_INFINITY, f64::INFINITY), 2.0));
    assert!(ball.occluded(DVec3::ZERO, DVec3::Z, 0.5, 1.5));
    assert!(!ball.occluded(DVec3::ZERO, DVec3::Z, 0.5, 0.9));
    let nothing = ball.intersect(DVec3::splat(f64::NAN), DVec3::X, 0.0, 1.0);
    assert_eq!(nothing, None);
    assert_eq!(ball.intersect(DVec3::ZERO, DVec3::ZERO, 0.0, 1.0), None);
}

/// However wild, a ray ends.
#[test]
fn the_number_of_evaluations_is_limited() {
    let wild = implicit("sin(1/(x^2 + 1e-9)) + 1.0000001 + abs(sin(1e4*y))*1e-9", 1.0);
    let mut effort = Effort::default();
    let hit =
        wild.solve(DVec3::new(-1.0, 0.1, 0.2), DVec3::new(1.0, 0.1, 0.0), 0.0, 9.0, &mut effort);
    assert!(effort.evaluations < 10_000 && hit.is_none(), "{effort:?} {hit:?}");
}

#[test]
fn points_are_moved_onto_the_surface() {
    for surface in &SURFACES {
        let shape = implicit(surface.text, surface.half);
        let mut hits = 0;
        for i in 0..300 {
            let a = f64::from(i);
            let o = DVec3::new(a.sin(), (2.3 * a).cos(), (0.7 * a).sin()).normalize() * 2.0;
            let aim = DVec3::new((1.1 * a).cos(), (0.3 * a).sin(), (1.9 * a).cos()) * 0.5;
            let (o, d) = (o * surface.half, (aim - o) * surface.half);
            let Some(hit) = shape.intersect(o, d, 0.0, f64::INFINITY) else { continue };
            let p = o + d * hit.t;
            let at = shape.surface_at(p + DVec3::new(1.0, -1.0, 1.0) * 1e-7, 0);
            hits += 1;
            assert!((at.position - p).length() < 1e-5, "{}: {p}", surface.text);
            let there = (surface.f)(at.position).abs();
            assert!(there < 1e-12, "{}: {p}: {there}", surface.text);
            assert!((at.normal.length() - 1.0).abs() < 1e-14);
            // Outside, f is positive.
            assert!((surface.f)(at.position + at.normal * 1e-6) > 0.0, "{}: {p}", surface.text);
        }
        assert!(hits > 30, "{}: {hits}", surface.text);
    }
    // The tip of a cone has no normal; any will do.
    let cone = implicit("x^2 + y^2 - z^2", 1.0);
    assert!((cone.surface_at(DVec3::ZERO, 0).normal.length() - 1.0).abs() < 1e-15);
}

#[test]
fn curvature_is_that_of_a_sphere() {
    let ball = implicit("sqrt(x^2 + y^2 + z^2) - 0.25", 0.3);
    let k = ball.curvature(DVec3::new(0.15, 0.2, 0.0), 0);
    assert!((4.0 - 1e-6..=4.0 * 2f64.sqrt() + 1e-6).contains(&k), "{k}");
    let rod = implicit("x^2 + y^2 - 0.25", 0.3);
    let k = rod.curvature(DVec3::new(0.3, 0.4, 0.1), 0);
    assert!((k - 2.0).abs() < 1e-6, "{k}");
}
