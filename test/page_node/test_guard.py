"""Who may come in: names, origins, tokens."""

import socket

import pytest

from page_node.refusal import RefusedError
from page_node.server.guard import AccessPolicy, host_name, is_loopback, is_origin_of, make_policy

TOKEN = 'a-token-that-nobody-guesses'
HOST = '127.0.0.1:8300'


@pytest.fixture
def alone():
    return make_policy('127.0.0.1', 8300, '', '')


@pytest.fixture
def shared():
    return make_policy('0.0.0.0', 8300, TOKEN, 'robot.example proxy')


def code_of(check, *arguments, **named):
    with pytest.raises(RefusedError) as caught:
        check(*arguments, **named)
    return caught.value.code


class TestHost:
    @pytest.mark.parametrize('host', [
        HOST, 'localhost:8300', 'LOCALHOST', '[::1]:8300', '127.0.0.1', 'localhost.'])
    def test_this_machine_is_ours(self, alone, host):
        alone.check_host(host)

    @pytest.mark.parametrize('host', [
        'evil.example', 'evil.example:8300', '', '127.0.0.1.evil.example', 'localhost.evil',
        'evil.example@127.0.0.1.evil.example', '[::1', 'a b', '127.0.0.1:8300.evil.example'])
    def test_a_name_of_somebody_else_is_not(self, alone, shared, host):
        for policy in (alone, shared):
            assert code_of(policy.check_host, host) == 'wrong_host'

    def test_a_shared_page_is_called_by_the_names_of_its_machine(self, alone, shared):
        for name in (socket.gethostname(), 'robot.example', 'PROXY:8443', '192.168.1.7:8300'):
            shared.check_host(name)
        assert code_of(alone.check_host, 'robot.example') == 'wrong_host'

    def test_names_are_read_without_port(self):
        assert host_name('[FE80::1]:80') == 'fe80::1'


class TestOrigin:
    def test_the_page_itself_may_do_everything(self, alone):
        for is_reading in (True, False):
            alone.check_origin(HOST, {'origin': f'http://{HOST}'}, is_reading)
        alone.check_origin('robot.example', {'origin': 'https://robot.example'}, False)

    @pytest.mark.parametrize('origin', [
        'http://evil.example', 'null', '', 'http://127.0.0.1:9999', 'http://127.0.0.1',
        f'http://{HOST}.evil.example', f'http://evil.example/{HOST}', f'file://{HOST}',
        f'http://{HOST}@evil.example', f'https://evil.example#http://{HOST}'])
    @pytest.mark.parametrize('is_reading', [True, False])
    def test_other_pages_may_do_nothing(self, alone, origin, is_reading):
        assert code_of(
            alone.check_origin, HOST, {'origin': origin}, is_reading) == 'wrong_origin'

    def test_what_changes_something_has_to_say_where_it_comes_from(self, alone):
        assert code_of(alone.check_origin, HOST, {}, False) == 'no_origin'

    def test_the_address_bar_and_the_page_may_read(self, alone):
        for site in ('none', 'same-origin'):
            alone.check_origin(HOST, {'sec-fetch-site': site}, True)
        alone.check_origin(HOST, {}, True)

    def test_others_may_link_but_not_embed(self, alone):
        link = {'sec-fetch-site': 'cross-site', 'sec-fetch-mode': 'navigate'}
        alone.check_origin(HOST, {**link, 'sec-fetch-dest': 'document'}, True)
        for dest in ('iframe', 'script', 'image', ''):
            assert code_of(alone.check_origin, HOST, {**link, 'sec-fetch-dest': dest}, True) == (
                'wrong_origin')

    def test_an_origin_is_compared_as_a_whole(self):
        assert is_origin_of('http://robot:8300', 'Robot:8300')
        assert not is_origin_of('http://robot:83000', 'robot:8300')


class TestToken:
    def test_alone_there_is_none(self, alone):
        assert alone.token == ''
        assert alone.knows({}, '')
        assert not alone.is_shown_in('token=')

    def test_one_is_made_where_others_can_come(self):
        tokens = {make_policy('0.0.0.0', 8300, '', '').token for _ in range(3)}
        assert len(tokens) == 3
        assert min(map(len, tokens)) >= 24

    def test_one_that_is_set_holds_on_this_machine_too(self):
        policy = make_policy('127.0.0.1', 8300, TOKEN, '')
        assert not policy.knows({}, '')
        assert policy.knows({}, f'token={TOKEN}')

    @pytest.mark.parametrize('query', [
        '', 'token=', 'token=wrong', f'token={TOKEN}x', f'token={TOKEN[:-1]}', f'Token={TOKEN}',
        f'token={TOKEN}&token=', 'token=%ff%fe', 'token=\xfc', 'a&' * 100])
    def test_nothing_else_will_do(self, shared, query):
        assert not shared.is_shown_in(query)
        assert not shared.knows({'cookie': query}, '')

    def test_it_may_stand_in_a_cookie(self, shared):
        assert shared.knows({'cookie': f'a=b; page_token_8300={TOKEN}'}, '')
        assert not shared.knows({'cookie': f'page_token_8301={TOKEN}'}, '')

    @pytest.mark.parametrize('cookie', [';;;', '=', 'page_token_8300', '\x00', 'a' * 4000])
    def test_a_cookie_that_is_none_is_none(self, shared, cookie):
        assert not shared.knows({'cookie': cookie}, '')


def test_loopback_is_what_only_this_machine_can_reach():
    assert all(map(is_loopback, ('127.0.0.1', '127.3.2.1', '::1', 'localhost')))
    assert not any(map(is_loopback, ('0.0.0.0', '::', '192.168.1.7', 'robot', '')))


def test_a_policy_is_made_of_what_it_says():
    policy = AccessPolicy('t', frozenset({'robot'}), 'c')
    assert policy.knows({'cookie': 'c=t'}, '')
