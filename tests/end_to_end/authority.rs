//! Certificates for tests, beside the configuration files that the documentation shows.

use std::path::{Path, PathBuf};

use rcgen::{
    BasicConstraints, Certificate, CertificateParams, CertifiedIssuer, DnType, ExtendedKeyUsagePurpose, IsCa, KeyPair,
    KeyUsagePurpose, date_time_ymd,
};

/// Who signs the certificates of a run's members.
pub struct Authority(CertifiedIssuer<'static, KeyPair>);

impl Authority {
    /// A new one.
    pub fn new(name: &str) -> Self {
        let mut params = named(name, vec![]);
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        Self(CertifiedIssuer::self_signed(params, KeyPair::generate().unwrap()).unwrap())
    }

    /// The folder of the process that listens on the loopback address, and in it the configuration returned.
    pub fn hub(&self, folder: &Path) -> PathBuf {
        let mut params = named("hub", vec!["127.0.0.1".into()]);
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
        self.sign(folder, params, self, "hub.json5")
    }

    /// The same with a certificate that has ended with a year.
    pub fn hub_until(&self, folder: &Path, year: i32) -> PathBuf {
        let mut params = named("hub", vec!["127.0.0.1".into()]);
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
        until(&mut params, year);
        self.sign(folder, params, self, "hub.json5")
    }

    /// A process that connects, with a certificate that has ended with a year.
    pub fn member_until(&self, folder: &Path, name: &str, year: i32) -> PathBuf {
        let mut params = named(name, vec![]);
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
        until(&mut params, year);
        self.sign(folder, params, self, "member.json5")
    }

    /// The folder of a process that connects.
    pub fn member(&self, folder: &Path, name: &str) -> PathBuf {
        self.member_who_trusts(self, folder, name)
    }

    /// One that would connect to a hub of another authority.
    pub fn member_who_trusts(&self, trusted: &Self, folder: &Path, name: &str) -> PathBuf {
        let mut params = named(name, vec![]);
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
        self.sign(folder, params, trusted, "member.json5")
    }

    /// One that has none.
    pub fn without_certificate(&self, folder: &Path) -> PathBuf {
        std::fs::create_dir_all(folder).unwrap();
        std::fs::write(folder.join("ca.crt"), self.certificate().pem()).unwrap();
        let config = folder.join("zenoh.json5");
        let text = "{ connect: { timeout_ms: 1000 }, transport: { link: { tls: { root_ca_certificate: 'ca.crt' } } } }";
        std::fs::write(&config, text).unwrap();
        config
    }

    fn certificate(&self) -> &Certificate {
        self.0.as_ref()
    }

    fn sign(&self, folder: &Path, params: CertificateParams, trusted: &Self, config: &str) -> PathBuf {
        std::fs::create_dir_all(folder).unwrap();
        let key = KeyPair::generate().unwrap();
        let signed = params.signed_by(&key, &self.0).unwrap();
        std::fs::write(folder.join("own.crt"), signed.pem()).unwrap();
        std::fs::write(folder.join("own.key"), key.serialize_pem()).unwrap();
        std::fs::write(folder.join("ca.crt"), trusted.certificate().pem()).unwrap();
        let documented = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/several-hosts").join(config);
        let to = folder.join("zenoh.json5");
        std::fs::copy(documented, &to).unwrap();
        to
    }
}

fn until(params: &mut CertificateParams, year: i32) {
    params.not_before = date_time_ymd(year - 1, 1, 1);
    params.not_after = date_time_ymd(year, 12, 31);
}

fn named(name: &str, hosts: Vec<String>) -> CertificateParams {
    let mut params = CertificateParams::new(hosts).unwrap();
    params.distinguished_name.push(DnType::CommonName, name);
    params
}
