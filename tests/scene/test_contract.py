"""The contract of effects: every effect keeps it, in its place and with its arguments."""

import importlib
import inspect

import pytest

from lowalt.scene.contract import ARGUMENTS, OFFERS, PLACE_ORDER
from lowalt.scene.effects import PLACES, dotted


@pytest.mark.parametrize("name", PLACES)
def test_every_effect_offers_functions_of_its_place_with_the_arguments_of_the_contract(name):
    module = importlib.import_module(dotted(name))
    offered = {
        function: getattr(module, function) for function in OFFERS if hasattr(module, function)
    }
    assert offered
    for function, found in offered.items():
        assert OFFERS[function].place in ("", PLACES[name])
        assert tuple(inspect.signature(found).parameters) == (
            "settings",
            *OFFERS[function].takes,
        ), function
    assert set(getattr(module, "UNMODELLED", ())) <= {"links", "fmcw", "cw"}
    assert getattr(module, "SET_SNR", None) in (None, *module.DEFAULTS)


def test_the_contract_explains_every_argument_and_its_places_are_those_of_the_chain():
    assert {argument for offer in OFFERS.values() for argument in offer.takes} == set(ARGUMENTS)
    assert {offer.place for offer in OFFERS.values()} == {"", *PLACE_ORDER}
    assert all(offer.returns for offer in OFFERS.values())


def test_every_function_of_the_contract_has_an_owner():
    modules = [importlib.import_module(dotted(name)) for name in PLACES]
    assert not [
        function for function in OFFERS if not any(hasattr(module, function) for module in modules)
    ]
