//! Embree's C interface as `bindgen` reads it from the installed headers, and the constants and
//! layout facts that the other files of this room rely on.

#![expect(non_snake_case, dead_code, unreachable_pub, clippy::all, reason = "generated from C")]

include!(concat!(env!("OUT_DIR"), "/embree.rs"));

// `rtcIntersect1` and friends require these alignments.
const _: () = assert!(align_of::<RTCRay>() == 16 && align_of::<RTCRayHit>() == 16);
const _: () = assert!(align_of::<RTCBounds>() == 16);
const _: () = assert!(align_of::<RTCRayHit16>() == 64);
// The header says "no id" with a C cast, which bindgen does not evaluate.
const _: () = assert!(super::INVALID_ID == !0);

#[cfg(test)]
mod tests {
    use super::*;
    use std::mem::{offset_of, size_of};
    use std::process::Command;

    /// The layout that rustc gives the structures is the one that the C compiler gives them.
    #[test]
    fn layout_is_the_c_compilers_own() {
        macro_rules! layouts {
            ($($ty:ident { $($field:ident),* $(,)? })*) => {{
                let mut c = String::from(
                    "#include <embree4/rtcore.h>\n#include <stdio.h>\n#include <stddef.h>\nint main(void) {\n",
                );
                let mut rust = String::new();
                $(
                    c += concat!("printf(\"", stringify!($ty), " %zu %zu\\n\", sizeof(struct ",
                        stringify!($ty), "), _Alignof(struct ", stringify!($ty), "));\n");
                    rust += &format!("{} {} {}\n", stringify!($ty), size_of::<$ty>(), align_of::<$ty>());
                    $(
                        c += concat!("printf(\"", stringify!($ty), ".", stringify!($field),
                            " %zu\\n\", offsetof(struct ", stringify!($ty), ", ", stringify!($field), "));\n");
                        rust += &format!("{}.{} {}\n", stringify!($ty), stringify!($field),
                            offset_of!($ty, $field));
                    )*
                )*
                c += "return 0; }\n";
                (c, rust)
            }};
        }
        let (c, rust) = layouts! {
            RTCRay { org_x, org_y, org_z, tnear, dir_x, dir_y, dir_z, time, tfar, mask, id, flags }
            RTCHit { Ng_x, Ng_y, Ng_z, u, v, primID, geomID, instID, instPrimID }
            RTCRayHit { ray, hit }
            RTCRay4 { org_x, tnear, dir_x, tfar, flags }
            RTCRayHit4 { ray, hit }
            RTCRay8 { org_x, tnear, dir_x, tfar, flags }
            RTCRayHit8 { ray, hit }
            RTCRay16 { org_x, tnear, dir_x, tfar, flags }
            RTCHit16 { Ng_x, Ng_y, Ng_z, u, v, primID, geomID, instID, instPrimID }
            RTCRayHit16 { ray, hit }
            RTCBounds { lower_x, lower_y, lower_z, upper_x, upper_y, upper_z }
            RTCRayQueryContext { instID, instPrimID }
            RTCIntersectArguments { flags, feature_mask, context, filter, intersect }
            RTCOccludedArguments { flags, feature_mask, context, filter, occluded }
            RTCBoundsFunctionArguments { geometryUserPtr, primID, timeStep, bounds_o }
            RTCIntersectFunctionNArguments { valid, geometryUserPtr, primID, context, rayhit, N, geomID }
            RTCOccludedFunctionNArguments { valid, geometryUserPtr, primID, context, ray, N, geomID }
        };

        let folder = tempfile::tempdir().unwrap();
        let (source, program) = (folder.path().join("layout.c"), folder.path().join("layout"));
        std::fs::write(&source, c).unwrap();
        let compiler = Command::new("cc")
            .arg("-I")
            .arg(env!("ALHAZEN_EMBREE_INCLUDE"))
            .arg(&source)
            .arg("-o")
            .arg(&program)
            .output()
            .expect("`make setup` installs a C compiler");
        assert!(compiler.status.success(), "{}", String::from_utf8_lossy(&compiler.stderr));
        let printed = Command::new(&program).output().unwrap();
        assert_eq!(rust, String::from_utf8(printed.stdout).unwrap());
    }
}
