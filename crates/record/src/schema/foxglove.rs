//! The public message types of Foxglove that are used here, by name and number.
//!
//! Taken from the published schemas; `tests/check.py` compares them with the package
//! `foxglove-schemas-protobuf`.

use super::Kind::{self, Bool, Bytes, Double, Fixed32, Int32, Int64, String};
use super::{Enum, Field, Message, many, one, plain};

const TIMESTAMP: Kind = Kind::Message("google.protobuf.Timestamp");
const DURATION: Kind = Kind::Message("google.protobuf.Duration");
const VECTOR: Kind = Kind::Message("foxglove.Vector3");
const QUATERNION: Kind = Kind::Message("foxglove.Quaternion");
const POINT: Kind = Kind::Message("foxglove.Point3");
const POSE: Kind = Kind::Message("foxglove.Pose");
const COLOR: Kind = Kind::Message("foxglove.Color");

const XYZ: &[Field] = &[
    one(1, "x", Double),
    one(2, "y", Double),
    one(3, "z", Double),
];
const SECONDS: &[Field] = &[one(1, "seconds", Int64), one(2, "nanos", Int32)];

#[rustfmt::skip]
pub(super) const MESSAGES: &[Message] = &[
    plain("google.protobuf.Timestamp", SECONDS),
    plain("google.protobuf.Duration", SECONDS),
    plain("foxglove.Vector3", XYZ),
    plain("foxglove.Point3", XYZ),
    plain("foxglove.Quaternion", &[one(1, "x", Double), one(2, "y", Double), one(3, "z", Double), one(4, "w", Double)]),
    plain("foxglove.Color", &[one(1, "r", Double), one(2, "g", Double), one(3, "b", Double), one(4, "a", Double)]),
    plain("foxglove.Pose", &[one(1, "position", VECTOR), one(2, "orientation", QUATERNION)]),
    plain("foxglove.KeyValuePair", &[one(1, "key", String), one(2, "value", String)]),
    plain("foxglove.FrameTransform", &[
        one(1, "timestamp", TIMESTAMP), one(2, "parent_frame_id", String), one(3, "child_frame_id", String),
        one(4, "translation", VECTOR), one(5, "rotation", QUATERNION),
    ]),
    plain("foxglove.FrameTransforms", &[many(1, "transforms", Kind::Message("foxglove.FrameTransform"))]),
    plain("foxglove.PosesInFrame", &[one(1, "timestamp", TIMESTAMP), one(2, "frame_id", String), many(3, "poses", POSE)]),
    Message {
        name: "foxglove.Log",
        fields: &[
            one(1, "timestamp", TIMESTAMP), one(2, "level", Kind::Enum("foxglove.Log.Level")), one(3, "message", String),
            one(4, "name", String), one(5, "file", String), one(6, "line", Fixed32),
        ],
        enums: &[Enum { name: "Level", values: &["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"] }],
    },
    plain("foxglove.ArrowPrimitive", &[
        one(1, "pose", POSE), one(2, "shaft_length", Double), one(3, "shaft_diameter", Double),
        one(4, "head_length", Double), one(5, "head_diameter", Double), one(6, "color", COLOR),
    ]),
    plain("foxglove.CubePrimitive", &[one(1, "pose", POSE), one(2, "size", VECTOR), one(3, "color", COLOR)]),
    plain("foxglove.SpherePrimitive", &[one(1, "pose", POSE), one(2, "size", VECTOR), one(3, "color", COLOR)]),
    plain("foxglove.CylinderPrimitive", &[
        one(1, "pose", POSE), one(2, "size", VECTOR), one(3, "bottom_scale", Double), one(4, "top_scale", Double),
        one(5, "color", COLOR),
    ]),
    Message {
        name: "foxglove.LinePrimitive",
        fields: &[
            one(1, "type", Kind::Enum("foxglove.LinePrimitive.Type")), one(2, "pose", POSE), one(3, "thickness", Double),
            one(4, "scale_invariant", Bool), many(5, "points", POINT), one(6, "color", COLOR), many(7, "colors", COLOR),
            many(8, "indices", Fixed32),
        ],
        enums: &[Enum { name: "Type", values: &["LINE_STRIP", "LINE_LOOP", "LINE_LIST"] }],
    },
    plain("foxglove.TriangleListPrimitive", &[
        one(1, "pose", POSE), many(2, "points", POINT), one(3, "color", COLOR), many(4, "colors", COLOR),
        many(5, "indices", Fixed32),
    ]),
    plain("foxglove.TextPrimitive", &[
        one(1, "pose", POSE), one(2, "billboard", Bool), one(3, "font_size", Double), one(4, "scale_invariant", Bool),
        one(5, "color", COLOR), one(6, "text", String),
    ]),
    plain("foxglove.ModelPrimitive", &[
        one(1, "pose", POSE), one(2, "scale", VECTOR), one(3, "color", COLOR), one(4, "override_color", Bool),
        one(5, "url", String), one(6, "media_type", String), one(7, "data", Bytes),
    ]),
    Message {
        name: "foxglove.SceneEntityDeletion",
        fields: &[
            one(1, "timestamp", TIMESTAMP), one(2, "type", Kind::Enum("foxglove.SceneEntityDeletion.Type")),
            one(3, "id", String),
        ],
        enums: &[Enum { name: "Type", values: &["MATCHING_ID", "ALL"] }],
    },
    plain("foxglove.SceneEntity", &[
        one(1, "timestamp", TIMESTAMP), one(2, "frame_id", String), one(3, "id", String), one(4, "lifetime", DURATION),
        one(5, "frame_locked", Bool), many(6, "metadata", Kind::Message("foxglove.KeyValuePair")),
        many(7, "arrows", Kind::Message("foxglove.ArrowPrimitive")), many(8, "cubes", Kind::Message("foxglove.CubePrimitive")),
        many(9, "spheres", Kind::Message("foxglove.SpherePrimitive")),
        many(10, "cylinders", Kind::Message("foxglove.CylinderPrimitive")),
        many(11, "lines", Kind::Message("foxglove.LinePrimitive")),
        many(12, "triangles", Kind::Message("foxglove.TriangleListPrimitive")),
        many(13, "texts", Kind::Message("foxglove.TextPrimitive")), many(14, "models", Kind::Message("foxglove.ModelPrimitive")),
    ]),
    plain("foxglove.SceneUpdate", &[
        many(1, "deletions", Kind::Message("foxglove.SceneEntityDeletion")),
        many(2, "entities", Kind::Message("foxglove.SceneEntity")),
    ]),
];
