//! A stiff hand on a rendered object: what comes out of the board, and whether it comes to rest.

use hwall_haptics::ObjectPortConfig;
use hwall_lab::feel::rig::Rig;
use hwall_lab::feel::stability::{SWINGS_ON_M, at_random};
use hwall_testkit::seeds;

/// Stiffer than any bare hand, N/m: then some energy may come out before the loop is felt to swing.
const STIFF_N_PER_M: f64 = 3000.0;
/// The most that a stiff one gets, J.
const OF_STIFF_J: f64 = 0.2;

#[test]
fn no_hand_gets_more_than_the_reserve() {
    let rig = Rig::new().unwrap();
    let reserve_j = ObjectPortConfig::default().reserve_j;
    let (mut hands, mut stiff, mut swings) = (0, 0, 0);
    for seed in seeds(1..2) {
        for held in at_random(&rig, 12, 1000 * seed).unwrap() {
            let is_stiff = held.stiffness_n_per_m > STIFF_N_PER_M;
            let most_j = if is_stiff { OF_STIFF_J } else { reserve_j };
            assert!(held.generated_j <= most_j, "{seed}: {held:?}");
            hands += 1;
            stiff += usize::from(held.generated_j > reserve_j);
            swings += usize::from(held.swing_m > SWINGS_ON_M);
        }
    }
    println!(
        "{hands} hands: {stiff} stiff ones got more than {reserve_j} J, {swings} boards swing on"
    );
    assert!(10 * swings <= hands, "{swings} of {hands}");
}
