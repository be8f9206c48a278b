from adeye.store.rules import Rule


def test_rule_names_its_view() -> None:
    rule = Rule("goal_without_fsr", "text", "remedy")
    assert rule.view == "v_check_goal_without_fsr"
    assert not rule.needs_evidence


def test_rule_that_sql_does_not_read_has_no_view() -> None:
    assert Rule("idle_fault", "text", "remedy", has_view=False).view == ""
