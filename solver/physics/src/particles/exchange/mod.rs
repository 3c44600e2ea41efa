//! What the particles read of other physics and write for them: frozen fields, contacts, loads on a substrate, energies.

pub mod contact_list;
pub mod external_fields;
pub mod ledger;
pub mod reply;
pub mod substrate;
