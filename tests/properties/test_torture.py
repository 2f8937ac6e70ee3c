"""A hundredth of the campaigns of `dev.py torture`; and what goes wrong in one is counted, whatever it is."""

import os

import pytest
from tests.properties.planted_trials import always_bad, bad_every_fifth, sleepy
from tools.torture.campaign import WORST, Campaign, run
from tools.torture.campaigns import CAMPAIGNS

pytestmark = pytest.mark.skipif(os.name == "nt", reason="asks for limits and signals as POSIX has them")


@pytest.mark.slow
@pytest.mark.parametrize("campaign", CAMPAIGNS, ids=lambda campaign: campaign.name)
def test_nothing_breaks_it(campaign):
    trials = max(1, campaign.trials // 100)
    outcome = run(campaign, trials, 600.0, seed=1)
    assert outcome.failures == []
    assert outcome.trials == trials


def test_what_goes_wrong_is_counted_and_the_rest_goes_on():
    outcome = run(Campaign("bad", bad_every_fifth, 25, 0.5, ""), 25, 300.0, seed=0)
    found = {failure.number: failure.kind for failure in outcome.failures}
    assert found == {0: "crash", 5: "hang", 10: "hang", 15: "silent", 20: "unclear"}
    assert outcome.trials == 25
    assert "dropped" in outcome.failures[3].text
    assert "bad_every_fifth" in outcome.failures[0].text  # the traceback of a crash


def test_a_campaign_ends_after_a_while_and_when_enough_went_wrong():
    assert run(Campaign("sleepy", sleepy, 1000, 5.0, ""), 1000, 4.0, seed=0).trials < 1000
    assert WORST <= len(run(Campaign("always bad", always_bad, 1000, 5.0, ""), 1000, 60.0, seed=0).failures)
