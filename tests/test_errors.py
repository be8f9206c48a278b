"""Errors: their text, their exit codes, and that they survive a process boundary."""

import pickle

import pytest

from adeye import errors

WHERE = errors.SourceLocation("odd/motorway.yaml", 14, 9)


def test_message_has_class_place_fault_and_remedy_and_ends_with_one_full_stop() -> None:
    place = "odd/motorway.yaml:14:9"
    assert str(WHERE) == place
    error = errors.SweepError("160 km/h is above 130 km/h", where=WHERE, remedy="Narrow the range.")
    assert str(error) == f"SweepError: {place}: 160 km/h is above 130 km/h. Narrow the range."
    for text, shown in (("no file", "no file."), ("no file.", "no file."), ("a file?", "a file?")):
        assert str(errors.SpecError(text)) == f"SpecError: {shown}"


def test_only_what_the_user_causes_is_an_input_error_and_ends_with_2() -> None:
    for kind in (
        errors.SpecError,
        errors.SweepError,
        errors.ExpressionError,
        errors.UnitError,
        errors.UsageError,
        errors.MissingExtra,
        errors.InputErrors,
    ):
        assert issubclass(kind, errors.InputError)
        assert kind.exit_code == 2
    assert (errors.IntegrityError.exit_code, errors.PlatformError.exit_code) == (4, 5)
    for other in (errors.IntegrityError, errors.PlatformError):
        assert issubclass(other, errors.AdeyeError)
        assert not issubclass(other, errors.InputError)


def test_only_a_module_of_somebody_else_is_a_missing_extra() -> None:
    for name in ("mcap", "a_part_of.mcap", None):
        with (
            pytest.raises(errors.MissingExtra, match=r"MCAP needs adeye\[viz\].*, or wait\.$"),
            errors.needing("MCAP", "viz", otherwise="wait"),
        ):
            raise ModuleNotFoundError(name=name)
    with pytest.raises(ModuleNotFoundError), errors.needing("MCAP", "viz"):
        raise ModuleNotFoundError(name="adeye.nothing")


def test_class_of_a_guest_has_the_exit_code_of_what_it_derives_from() -> None:
    for chosen in (0, 1, 256):
        says = {"exit_code": chosen}
        mine = type("Mine", (errors.IntegrityError,), says)
        posing = type("SpecError", (mine,), {**says, "__module__": errors.__name__})
        assert errors.code_of(mine("x")) == errors.code_of(posing("x")) == 4


def test_several_errors_are_listed_and_counted() -> None:
    one = errors.SpecError("one", where=WHERE)
    lines = ["SpecError: odd/motorway.yaml:14:9: one.", "UnitError: two.", "2 errors."]
    assert str(errors.InputErrors([one, errors.UnitError("two")])).splitlines() == lines
    assert str(errors.InputErrors([one])).endswith("\n1 error.")
    text = str(errors.InputErrors([one], unlisted=1_999))
    assert text.endswith("\n2,000 errors, the first 1 are listed.")


def test_error_survives_pickling() -> None:
    for error in (
        errors.SweepError("wrong", where=WHERE, remedy="Mend it."),
        errors.SpecError("wrong"),
        errors.MissingExtra.of("a signature", "sign"),
        errors.InputErrors(
            [errors.SpecError("one", where=WHERE), errors.UnitError("two")], unlisted=3
        ),
        errors.PlatformError("disk full"),
    ):
        copy = pickle.loads(pickle.dumps(error))  # noqa: S301 - our own bytes
        assert type(copy) is type(error)
        assert str(copy) == str(error)


def test_suggest_names_the_nearest_word_else_all_that_are_allowed() -> None:
    names = ["cut_in", "cut_out"]
    assert errors.suggest("cut_inn", names) == "Did you mean 'cut_in'?"
    assert errors.suggest("x", names) == "Allowed: cut_in, cut_out."
    assert errors.suggest("x", []) == "Nothing is allowed here."
