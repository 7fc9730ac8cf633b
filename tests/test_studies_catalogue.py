"""Studies by name: what is missing is told as what it is."""

from __future__ import annotations

import pytest

from olivevib.errors import UsageError
from olivevib.studies.catalogue import Entry


def test_a_package_that_is_not_installed_is_named(monkeypatch):
    def missing(_):
        raise ModuleNotFoundError("no", name="pupil_apriltags")

    monkeypatch.setattr("olivevib.studies.catalogue.import_module", missing)
    with pytest.raises(UsageError, match="needs the package pupil_apriltags"):
        Entry("one", "", "one:run").load()


def test_a_file_of_the_project_that_is_missing_is_no_package_to_install():
    with pytest.raises(ModuleNotFoundError, match="no_such_study"):
        Entry("one", "", "no_such_study:run").load()
