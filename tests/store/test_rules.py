from adeye.store.rules import Rule


def test_rule_names_its_view() -> None:
    rule = Rule("goal_without_fsr", "text", "remedy", "SELECT 1")
    assert rule.view == "v_check_goal_without_fsr"
    assert not rule.needs_evidence
