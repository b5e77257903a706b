//! What users of a first try met.

use super::{Finding, finding};

const LINES: &str = "tests/tests/command_lines.rs";
const BETWEEN: &str = "crates/psychophysics/tests/between_and_missing.rs";

/// Of a first use: what somebody looked for and did not find, or read and did not understand.
pub const OF_A_FIRST_USE: &[Finding] = &[
    finding(
        "",
        "errors of URDF did not name the two ends; xacro was malformed XML",
        &[
            ("crates/kinematics/tests/urdf.rs", "branches_need_names"),
            ("crates/kinematics/tests/urdf.rs", "a_macro_is_named_as_one"),
        ],
    ),
    finding(
        "",
        "no pose from roll, pitch and yaw, or from a matrix",
        &[
            (
                "crates/geometry/tests/identities.rs",
                "roll_pitch_yaw_turns_about_fixed_axes",
            ),
            (
                "crates/geometry/tests/faults.rs",
                "a_matrix_that_is_not_homogeneous_is_named",
            ),
        ],
    ),
    finding(
        "",
        "parameters of S-R-S arms only by hand, and not from URDF",
        &[
            (
                "crates/kinematics/tests/srs_from_chain.rs",
                "parameters_need_no_torques_and_no_tool",
            ),
            (
                "crates/kinematics/tests/srs_from_chain.rs",
                "the_presets_come_back",
            ),
            (
                "crates/kinematics/tests/srs_from_chain.rs",
                "what_is_no_such_arm_says_which_joint",
            ),
        ],
    ),
    finding(
        "",
        "reachability of vertical walls only",
        &[
            (
                "crates/reachability/tests/plane.rs",
                "a_ramp_is_looked_up_by_lines",
            ),
            (
                "crates/reachability/tests/plane.rs",
                "outside_their_bands_lines_are_never_wrong",
            ),
        ],
    ),
    finding(
        "",
        "single lines, but no maps, for arms without a closed form",
        &[(
            "crates/reachability/tests/optimization.rs",
            "a_map_of_walls_for_any_chain",
        )],
    ),
    finding(
        "",
        "from a scene to its walls in many calls",
        &[(
            "tests/tests/maps.rs",
            "the_maps_of_a_room_say_what_the_board_can_do",
        )],
    ),
    finding(
        "",
        "no texture for a wanted roughness",
        &[
            (
                "crates/texton/tests/design.rs",
                "what_is_designed_is_predicted",
            ),
            (
                "crates/texton/tests/design.rs",
                "what_is_out_of_reach_names_the_nearest",
            ),
        ],
    ),
    finding(
        "",
        "studies in wide tables, with semicolons, between subjects only, or with gaps were refused",
        &[
            (
                BETWEEN,
                "semicolons_tabs_and_wide_tables_are_the_same_study",
            ),
            (BETWEEN, "groups_alone_are_a_one_way_analysis"),
            (BETWEEN, "incomplete_subjects_are_left_out_and_named"),
        ],
    ),
    finding(
        "",
        "trials that came to nothing were analysed with the others; pairs did not name their error; intervals without their estimate",
        &[
            (BETWEEN, "rows_that_are_not_valid_are_left_out_and_counted"),
            (LINES, "tables_of_studies_are_analysed_as_they_are_written"),
            (BETWEEN, "pairs_name_the_error_that_they_are_tested_against"),
            (
                BETWEEN,
                "intervals_hold_the_estimate_that_is_printed_beside_them",
            ),
        ],
    ),
    finding(
        "",
        "the calibrated prediction was hard to find",
        &[(
            "crates/bip/tests/evaluation.rs",
            "held_out_motions_are_predicted_and_intervals_hold",
        )],
    ),
    finding(
        "",
        "a made-up hand, and a recording of several trials, gave no hint how to go on",
        &[
            (
                "tests/tests/bad_files.rs",
                "a_made_up_hand_is_told_of_its_flag_at_once",
            ),
            (
                "crates/stage/src/input/trial.rs",
                "one_of_several_trials_is_chosen_by_its_name",
            ),
        ],
    ),
    finding(
        "",
        "`contact_study` wrote two studies to the same files",
        &[
            (
                "tests/tests/contact_study_files.rs",
                "studies_of_like_names_write_their_own_files",
            ),
            (
                "crates/lab/src/contact/recordings.rs",
                "no_two_studies_write_the_same_files",
            ),
        ],
    ),
    finding(
        "",
        "`base_placement` found bases in the walls, left out surfaces silently, ignored flags",
        &[
            (
                "crates/lab/src/reach/placement.rs",
                "a_house_needs_a_place_in_it_and_a_room_does_not",
            ),
            (
                "crates/lab/src/reach/placement.rs",
                "surfaces_without_targets_are_named_unless_they_were_left_out_on_purpose",
            ),
            (LINES, "the_base_stands_behind_the_walls_it_serves"),
        ],
    ),
    finding(
        "",
        "one verdict about printing said yes where every printer said no",
        &[(
            "crates/lab/src/texture/patch.rs",
            "there_is_one_verdict_about_printing",
        )],
    ),
    finding(
        "",
        "reasons were told in the words of the program's source",
        &[
            (
                "crates/bridge/src/server/reply.rs",
                "reasons_are_told_in_words",
            ),
            (
                "crates/haptics/src/safety/words.rs",
                "states_are_told_in_words",
            ),
        ],
    ),
    finding(
        "",
        "packages without licence, feature labels, or links that hold",
        &[(
            "tests/tests/publishing.rs",
            "published_crates_have_what_a_registry_and_its_pages_need",
        )],
    ),
    finding(
        "",
        "legends and labels over each other in figures, greys that cannot be told apart",
        &[
            (
                "tests/tests/figures.rs",
                "no_label_lies_over_another_or_is_cut_off",
            ),
            ("tests/tests/figures.rs", "colours_of_curves_differ"),
            (
                "crates/lab/src/speed/page/multiples.rs",
                "ticks_leave_room_for_their_words",
            ),
        ],
    ),
    finding(
        "",
        "tables that their programs no longer write",
        &[
            (
                "tests/tests/documents.rs",
                "every_kind_of_person_is_in_the_table_of_times",
            ),
            ("tests/tests/documents.rs", "every_fault_is_in_the_matrix"),
            (
                "tests/tests/documents.rs",
                "what_is_felt_has_the_columns_of_its_program",
            ),
            (
                "tests/tests/documents.rs",
                "the_readme_quotes_the_speeds_at_hand",
            ),
            (
                "tests/tests/documents.rs",
                "findings_are_held_by_tests_that_there_are",
            ),
        ],
    ),
];
