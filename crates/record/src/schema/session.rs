//! This crate's own messages: inputs and outputs of a session, and values to plot.

use super::Kind::{self, Bool, Double, String, Uint32, Uint64};
use super::{Enum, Message, many, one, plain};

const VECTOR: Kind = Kind::Message("foxglove.Vector3");
const OPTION: Kind = Kind::Message("foxglove.KeyValuePair");

#[rustfmt::skip]
pub(super) const MESSAGES: &[Message] = &[
    plain("hwall.Setup", &[
        one(1, "program", String), one(2, "scene_obj", String), one(3, "scene_sidecar", String), one(4, "arm", String),
        one(5, "arm_urdf", String), one(6, "board_half_width_m", Double), one(7, "board_half_height_m", Double),
        one(8, "board_thickness_m", Double), many(9, "options", OPTION),
    ]),
    plain("hwall.Run", &[one(1, "sequence", Uint64), one(2, "number", Uint32), many(3, "options", OPTION)]),
    plain("hwall.Frame", &[
        one(1, "sequence", Uint64), one(2, "t_s", Double), one(3, "palm_m", VECTOR), one(4, "thumb_m", VECTOR),
        one(5, "index_m", VECTOR), one(6, "middle_m", VECTOR), one(7, "ring_m", VECTOR), one(8, "little_m", VECTOR),
        one(9, "head_m", VECTOR), one(10, "gaze", VECTOR), one(11, "wrist_m", VECTOR), one(12, "forearm_m", VECTOR),
        one(13, "elbow_m", VECTOR), one(14, "shoulder_m", VECTOR), one(15, "grip_m", VECTOR),
        one(16, "aim_m", VECTOR), one(17, "is_of_another", Uint64),
        one(18, "other_hand_m", VECTOR), one(19, "bystanders_and_one", Uint64), one(20, "bystander_1_m", VECTOR),
        one(21, "bystander_2_m", VECTOR), one(22, "bystander_3_m", VECTOR), one(23, "bystander_4_m", VECTOR),
    ]),
    plain("hwall.World", &[
        one(1, "sequence", Uint64), one(2, "t_s", Double), one(3, "position_m", VECTOR),
        many(4, "rotation_columns", Double),
    ]),
    Message {
        name: "hwall.Request",
        fields: &[
            one(1, "sequence", Uint64), one(2, "kind", Kind::Enum("hwall.Request.Kind")), one(3, "value_s", Double),
            one(4, "step", Uint64), one(5, "surfaces", Uint64),
        ],
        enums: &[Enum { name: "Kind", values: &["STOP", "RESET", "CLOCK_OFFSET", "REFUSED", "PLANNED", "PERCEIVED"] }],
    },
    Message {
        name: "hwall.Cycle",
        fields: &[
            one(1, "sequence", Uint64), one(2, "t_s", Double), one(3, "state_t_s", Double), many(4, "q_rad", Double),
            many(5, "qd_rad_per_s", Double), many(6, "external_torque_n_m", Double),
            one(7, "command", Kind::Enum("hwall.Cycle.Command")), many(8, "command_values", Double),
        ],
        enums: &[Enum { name: "Command", values: &["HOLD", "POSITION", "TORQUE"] }],
    },
    plain("hwall.End", &[one(1, "sequence", Uint64), one(2, "dropped", Uint64)]),
    Message {
        name: "hwall.State",
        fields: &[
            one(1, "t_s", Double), one(2, "state", Kind::Enum("hwall.State.State")), one(3, "hand_tracked", Bool),
            one(4, "normal_force_n", Double), one(5, "force_n", VECTOR), one(6, "contact_in_s", Double),
            one(7, "board_there_in_s", Double), one(8, "lead_s", Double), one(9, "probability", Double),
            one(10, "hand_distance_m", Double), many(11, "openings", Double), many(12, "q_rad", Double),
        ],
        enums: &[Enum {
            name: "State",
            values: &[
                "HOLDING", "WAITING", "GETTING_READY", "APPROACHING", "LATE", "OBSTRUCTED", "IN_PLACE", "TOUCHED",
                "TOUCHED_IN_MOVING_WORLD", "SAFE", "OTHER",
            ],
        }],
    },
];
