"""The tables and columns of an archive: everything, or a reason why not."""

from gaplab.services.archives.columns import COLUMNS_LEFT_OUT, EXPORTED, LEFT_OUT, columns_of
from gaplab.services.store.models import Base

TABLES = Base.metadata.tables


def test_every_table_is_exported_or_left_out_for_a_reason() -> None:
    assert set(EXPORTED) | set(LEFT_OUT) == set(TABLES)
    assert not set(EXPORTED) & set(LEFT_OUT)
    reasons = [reason for columns in COLUMNS_LEFT_OUT.values() for reason in columns.values()]
    assert all(len(reason) > 10 for reason in (*LEFT_OUT.values(), *reasons))


def test_every_column_that_is_left_out_exists() -> None:
    assert set(COLUMNS_LEFT_OUT) <= set(EXPORTED)
    for table, columns in COLUMNS_LEFT_OUT.items():
        assert set(columns) <= set(TABLES[table].columns.keys())


def test_a_table_comes_after_those_that_it_refers_to() -> None:
    for place, name in enumerate(EXPORTED):
        for key in TABLES[name].foreign_keys:
            if (other := key.column.table.name) in EXPORTED:
                assert EXPORTED.index(other) <= place, (name, other)


def test_no_exported_column_refers_to_a_table_that_is_left_out() -> None:
    for name in EXPORTED:
        kept = {each.name for each in columns_of(name)}
        outside = {key.parent.name for key in TABLES[name].foreign_keys if key.column.table.name in LEFT_OUT}
        assert not kept & outside, name


def test_every_column_is_exported_or_can_be_left_out() -> None:
    for name in EXPORTED:
        kept = {each.name for each in columns_of(name)}
        for column in TABLES[name].columns:
            replaced = column.name in {"repetition_id", "content"} or TABLES[name].autoincrement_column is column
            if column.name not in kept and not replaced:
                assert column.nullable or column.default is not None, (name, column.name)


def test_every_exported_table_belongs_to_an_experiment_or_is_its_study() -> None:
    for name in set(EXPORTED) - {
        "study",
        "experiment",
        "provenance",
        "file",
        "attachment",
    }:  # the last three are shared
        assert {"experiment_id", "repetition_id"} & set(TABLES[name].columns.keys()), name
