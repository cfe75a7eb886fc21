"""Free, selected or all bones are baked; bones that the run does not move are named."""

from stage import bake, character, check_equal, curves, new_scene, recorded, refusal, select

new_scene()
rig = character()
run = recorded(rig)


def baked(strip):
    return {path.split('"')[1] for path, _ in curves(strip.action)}


select(rig, "tip")
assert baked(bake(rig, "SELECTED")) == {"tip"}
assert baked(bake(rig, "FREE")) == {"tail", "tip"}
strip = bake(rig, "ALL")
assert baked(strip) == {"trunk", "tail", "tip"}
assert ('pose.bones["trunk"].location', 0) in curves(strip.action)
check_equal(rig, run, ("trunk", "tail", "tip"))
assert [track.name[:9] for track in rig.animation_data.nla_tracks[1:]] == ["flowborne"] * 3

rig.pose.bones["tip"].name = "end"
assert "armature 'rig' has no bone 'tip' of the run: rename it back" in refusal(rig)
select(rig, "end")
assert "the run does not move bone 'end'. Select some of: trunk, tail, tip" in refusal(
    rig, bones="SELECTED"
)
select(rig)
assert "no bone is selected" in refusal(rig, bones="SELECTED")
